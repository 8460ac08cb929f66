#!/usr/bin/env python3
"""Holds dependencies against deny.toml, offline: licenses, bans, sources; and the list of what is linked.

    check_dependencies.py              checks, and that firmware/onboard/packaging/third-party.md is current
    check_dependencies.py --write      writes that list anew
    check_dependencies.py --texts OUT  writes the license texts of all that is linked, each text once, with
                                       the crates that carry it

Needs cargo and the crates as `cargo fetch --locked` leaves them; no other program, no network. Plain Python.
"""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import ROOT, output_of
from lib.verdict import fail

LIST = ROOT / "firmware/onboard/packaging/third-party.md"
PROGRAMS = ["biplane", "biplane-onboard", "biplane-mock"]
HEAD = """# Third-party crates in the programs

Linked into `biplane`, `biplane-onboard` and `biplane-mock` on Linux, with default features.
Their license texts are in the package, in `third-party-licenses.txt`.
Written by `tests/outside/package/check_dependencies.py --write`; the gate checks that it is current.

| crate | version | license |
|---|---|---|
"""


def cargo(*words):
    return output_of("cargo", *words, cwd=ROOT, stderr=subprocess.PIPE)


def packages():
    """All third-party packages of the lock, on any target."""
    metadata = json.loads(cargo("metadata", "--locked", "--format-version", "1"))
    members = set(metadata["workspace_members"])
    return [package for package in metadata["packages"] if package["id"] not in members]


def linked():
    """Name and version of the crates whose code is in the programs."""
    words = [word for program in PROGRAMS for word in ("-p", program)]
    tree = cargo(
        "tree",
        "--locked",
        *words,
        "-e",
        "normal,no-proc-macro",
        "--target",
        "x86_64-unknown-linux-gnu",
        "--prefix",
        "none",
        "--format",
        "{p}",
    )
    pairs = {tuple(line.split()[:2]) for line in tree.splitlines() if line.strip()}
    return sorted((name, version.lstrip("v")) for name, version in pairs if not name.startswith("biplane"))


def satisfied(expression, allowed):
    """Whether an SPDX expression can be met by allowed licenses. A slash is how older crates write OR."""
    tokens = re.findall(r"\(|\)|[^\s()]+", expression.replace("/", " OR "))
    words = []
    for token in tokens:
        # "X WITH Y" is one license.
        if words and (token == "WITH" or words[-1].endswith(" WITH")):
            words[-1] += f" {token}"
        else:
            words.append(token)
    code = {"OR": "or", "AND": "and", "(": "(", ")": ")"}
    # Nothing but brackets, words of logic and True or False reaches eval.
    return eval(" ".join(code.get(word, str(word in allowed)) for word in words))  # noqa: S307


def wrong(package, rules):
    """What is against the rules in one package."""
    name, terms = package["name"], package["license"]
    allowed = set(rules["licenses"]["allow"])
    for exception in rules["licenses"]["exceptions"]:
        if exception["crate"] == name:
            allowed |= set(exception["allow"])
    if not terms or not satisfied(terms, allowed):
        yield f"{name} {package['version']}: license {terms}; deny.toml allows {sorted(allowed)}"
    if name in {ban["crate"] for ban in rules["bans"]["deny"]}:
        yield f"{name} {package['version']}: banned by deny.toml"
    if package["source"] not in {f"registry+{url}" for url in rules["sources"]["allow-registry"]}:
        yield f"{name} {package['version']}: from {package['source']}, which deny.toml does not allow"


def table(all_packages):
    licenses = {(package["name"], package["version"]): package["license"] for package in all_packages}
    return HEAD + "".join(
        f"| {name} | {version} | {licenses[name, version]} |\n" for name, version in linked()
    )


def texts(all_packages):
    """Each license text once, below the crates that carry it."""
    folders = {(p["name"], p["version"]): Path(p["manifest_path"]).parent for p in all_packages}
    carriers, without = {}, []
    for name, version in linked():
        found = [
            path
            for path in sorted(folders[name, version].iterdir())
            if path.is_file() and re.match(r"(?i)(licen[cs]e|copying|notice|unlicense)", path.name)
        ]
        for path in found:
            text = path.read_text(errors="replace").replace("\r\n", "\n").strip()
            carriers.setdefault(text, []).append(f"{name} {version}")
        if not found:
            without.append(f"{name} {version}")
    parts = [f"{', '.join(dict.fromkeys(names))}\n\n{text}\n" for text, names in carriers.items()]
    parts.append(
        "These carry no text of their own; their licenses stand in third-party.md: "
        + ", ".join(without)
        + "\n"
    )
    return ("\n" + "-" * 100 + "\n\n").join(parts)


def main(words):
    all_packages = packages()
    rules = tomllib.loads((ROOT / "deny.toml").read_text())
    if words[:1] == ["--texts"]:
        Path(words[1]).write_text(texts(all_packages))
        return
    problems = [problem for package in all_packages for problem in wrong(package, rules)]
    current = table(all_packages)
    if words == ["--write"]:
        LIST.write_text(current)
    elif not LIST.exists() or LIST.read_text() != current:
        problems.append(
            f"{LIST.relative_to(ROOT)} is not current: tests/outside/package/check_dependencies.py --write"
        )
    if problems:
        fail("\n".join(problems))
    count = current.count("\n") - HEAD.count("\n")
    print(f"{len(all_packages)} crates: licenses, bans and sources as deny.toml says; {count} linked")


main(sys.argv[1:])
