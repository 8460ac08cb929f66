#!/usr/bin/env python3
"""Judges the length of sentences in the texts that users read.

    check_sentences.py                 README, docs/*.md, and the help of every program that is on PATH
    check_sentences.py --list [FILE]   prints the long sentences, longest first

A sentence ends at a period, a question mark or an exclamation mark, or with its paragraph, list item or table
cell. Items of a table cell are divided by semicolons. Code and addresses count as one word each. README and
the help may have no sentence of more than 30 words. Of the sentences in docs 20 in 1000 may be."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import ROOT
from lib.verdict import require

MOST_WORDS = 30
MOST_LONG_SHARE = 0.02
PROGRAMS = ("biplane", "biplane-onboard", "biplane-mock")
# A period that ends no sentence.
SHORT_FORMS = re.compile(r"\b(e\.g|i\.e|et al|etc|vs|cf|Fig|No|approx)\.", re.I)


def blocks_of(markdown):
    """Paragraphs, list items and table cells, without code."""
    text = re.sub(r"^ *```.*?^ *```", "\n", markdown, flags=re.S | re.M)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    text = re.sub(r"^\|[-:| ]+\|$", "", text, flags=re.M)
    block = []
    for line in [*text.splitlines(), ""]:
        stripped = line.strip()
        starts = not stripped or re.match(r"([-*+]|\d+\.)\s|#|\||!\[|\*[^*]", stripped)
        if starts and block:
            yield " ".join(block)
            block = []
        if stripped.startswith("|"):
            cells = re.sub(r"`[^`]*`", "code", stripped).strip("|").split("|")
            yield from (item for cell in cells for item in cell.split(";"))
        elif stripped:
            block.append(stripped)


def plain(block):
    """The block's words as a reader counts them."""
    text = re.sub(r"!\[([^\]]*)\]\([^)]*\)", r"\1.", block)
    text = re.sub(r"`+[^`]*`+", "code", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"https?://\S+", "address", text)
    text = SHORT_FORMS.sub(r"\1", text)
    return re.sub(r"^([-+]|\d+\.)\s|[*#_]", "", text)


def sentences_of(blocks):
    """Each sentence as its list of words."""
    for block in blocks:
        for sentence in re.split(r"[.!?](?=[\s\")]|$)", plain(block)):
            words = [word for word in sentence.split() if re.search(r"\w", word)]
            if words:
                yield words


def help_blocks(program, command=()):
    """The paragraphs of a command's help, and of those below it."""
    done = subprocess.run([program, *command, "--help"], text=True, capture_output=True, timeout=60)
    text = done.stdout
    names = []
    if "\nCommands:\n" in text:
        listed = text.split("\nCommands:\n", 1)[1].split("\n\n", 1)[0]
        names = re.findall(r"^  ([a-z][\w-]*)", listed, re.M)
    text = re.sub(r"^Usage:.*$|^Examples?:\n(?:  .*\n?)+", "", text, flags=re.M)
    paragraph = []
    for line in [*text.splitlines(), ""]:
        # A flag, a value or a command begins a paragraph of its own; what it takes is no part of a sentence.
        begins = re.match(r"\s*-|\s+[\w-]+\s{2,}|\S.*:$|\s*[\[<]", line)
        if (begins or not line.strip()) and paragraph:
            yield " ".join(paragraph)
            paragraph = []
        words = re.sub(r"^\s*-\S.*?(\s{2,}|$)|\[(default|possible values|aliases?):.*?(\]|$)", "", line)
        if words.strip():
            paragraph.append(words.strip())
    for name in names:
        if name != "help":
            yield from help_blocks(program, (*command, name))


def texts():
    """Each text with its name and the share of long sentences that it may have."""
    yield "README.md", blocks_of((ROOT / "README.md").read_text()), 0.0
    docs = sorted((ROOT / "docs").glob("*.md"))
    yield "docs", (block for page in docs for block in blocks_of(page.read_text())), MOST_LONG_SHARE
    for program in PROGRAMS:
        if shutil.which(program):
            yield f"{program} --help", help_blocks(program), 0.0


def main(words):
    if words[:1] == ["--list"]:
        pages = {path: blocks_of(Path(path).read_text()) for path in words[1:]}
        found = pages.items() if pages else [(name, blocks) for name, blocks, _ in texts()]
        for name, blocks in found:
            for sentence in sorted(sentences_of(blocks), key=len, reverse=True):
                if len(sentence) > MOST_WORDS:
                    print(f"{name}: {len(sentence)}: {' '.join(sentence)}")
        return
    for name, blocks, share in texts():
        all_of_it = list(sentences_of(blocks))
        long = [sentence for sentence in all_of_it if len(sentence) > MOST_WORDS]
        print(f"{name}: {len(all_of_it)} sentences, {len(long)} over {MOST_WORDS} words")
        longest = " ".join(max(long, key=len, default=[]))
        require(len(long) <= share * len(all_of_it), f"{name} has {len(long)} long sentences: {longest}")


main(sys.argv[1:])
