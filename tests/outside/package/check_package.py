#!/usr/bin/env python3
"""The Debian package, judged by Debian's own tools; then installed, used, started as its unit would start it,
and purged.

    check_package.py PACKAGE.deb WORKDIR

As root on a machine without it, it is installed by dpkg and purged at the end. Otherwise it is unpacked into
WORKDIR, and what only an installation can show is left out, said so. Needs dpkg, lintian, systemd-analyze,
udevadm, man, zsh and fish; plain Python. Takes three minutes."""

import gzip
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import fresh_folder, outcome_of, output_of, run, run_check
from lib.verdict import Tally, leave_out, require

PROGRAMS = ("biplane", "biplane-onboard", "biplane-mock")
FILES = [
    "usr/bin/biplane",
    "usr/bin/biplane-onboard",
    "usr/bin/biplane-mock",
    "usr/libexec/biplane/ladder",
    "etc/biplane/rig.toml",
    "usr/lib/systemd/system/biplane-onboard.service",
    "usr/lib/udev/rules.d/90-biplane.rules",
    "usr/lib/sysusers.d/biplane.conf",
    "usr/share/man/man1/biplane-onboard-record.1.gz",
    "usr/share/bash-completion/completions/biplane-onboard",
    "usr/share/zsh/vendor-completions/_biplane",
    "usr/share/fish/vendor_completions.d/biplane-mock.fish",
    "usr/share/doc/biplane/copyright",
    "usr/share/doc/biplane/third-party.md",
    "usr/share/doc/biplane/third-party-licenses.txt",
]
# How much of the system the service could reach if it were taken over: `systemd-analyze security`, in tenths.
LARGEST_EXPOSURE = 20
LEAST_COMMANDS = 40
RUNGS = ("port", "laser", "scans", "lasers", "base", "rig", "stand", "fault", "drive", "soak")
RUNGS_WITHOUT_DEVICES = ("port", "laser", "base", "rig", "stand")
NO_DEVICES = '[horizontal]\nport = "/nowhere/a"\n[base]\nport = "/nowhere/b"\n'
# What bash offers after a word.
COMPLETE_BASH = """source "$1"; COMP_WORDS=("$2" "$3"); COMP_CWORD=1
"$(complete -p "$2" | sed "s/.*-F \\([^ ]*\\).*/\\1/")" "$2" "$3" "$2"; echo "${COMPREPLY[@]}" """
COMPLETED = [
    ("biplane-onboard", "rec", "record recover"),
    ("biplane", "bu", "build"),
    ("biplane-mock", "ser", "serve"),
]
RECORDINGS = Path("/var/lib/biplane")


def has_user():
    return outcome_of("id", "-u", "biplane")[0] == 0


class Package:
    """The package, unpacked and, if that may be, installed."""

    def __init__(self, package, work):
        self.package, self.work = package, work
        self.tally = Tally()
        # Manual pages and completions are read here: a system may be set to install none (dpkg's
        # path-exclude).
        self.unpacked = work / "unpacked"
        self.root = self.unpacked
        self.is_installed = False
        self.had_user = has_user()

    def archive(self):
        listed = output_of("dpkg-deb", "--contents", self.package)
        for file in FILES:
            require(f" ./{file}\n" in listed, f"{file} is missing")
        files = sum(not line.endswith("/") for line in listed.splitlines())
        self.tally.ok(f"{files} files, {self.package.stat().st_size} bytes")
        run("lintian", "--allow-root", "--fail-on", "error", "--tag-display-limit", 0, self.package)
        self.tally.ok("lintian has no error")

    def install(self):
        run("dpkg-deb", "--extract", self.package, self.unpacked)
        is_there = outcome_of("dpkg", "-s", "biplane")[0] == 0
        if os.getuid() == 0 and not is_there:
            self.root, self.is_installed = Path("/"), True
            output_of("dpkg", "--force-confnew", "--install", self.package, stderr=subprocess.STDOUT)
            groups = output_of("id", "-nG", "biplane").split()
            require("dialout" in groups, "the user biplane is not in the group dialout")
            self.tally.ok(f"installed; {output_of('id', 'biplane').strip()}")
        else:
            leave_out("installing and purging (not root, or biplane is installed)")
        os.environ["PATH"] = f"{self.root / 'usr/bin'}:{os.environ['PATH']}"

    def programs(self):
        for program in PROGRAMS:
            own = shutil.which(program) == str(self.root / "usr/bin" / program)
            require(own, f"{program} on PATH is not the package's")
            run(program, "--version")
        output_of("biplane-onboard", "check-config", "--rig", self.root / "etc/biplane/rig.toml")

    def manual_pages(self):
        pages = sorted(self.unpacked.glob("usr/share/man/man1/biplane*.1.gz"))
        require(pages, "there is no manual page")
        for page in pages:
            words = ["man", "-l", "--warnings", page]
            quiet = dict(os.environ, LC_ALL="C.UTF-8", MANWIDTH="80")
            done = subprocess.run(words, env=quiet, capture_output=True, text=True, errors="replace")
            require(
                done.returncode == 0 and done.stdout and not done.stderr,
                f"{page} does not render: {done.stderr}",
            )
        self.tally.ok(f"{len(pages)} manual pages render without a warning")
        named = sum(self.pages_of(program) for program in PROGRAMS)
        require(named >= LEAST_COMMANDS, f"only {named} commands in the programs' --help")
        self.tally.ok(f"{named} commands have a manual page each")

    def pages_of(self, *command):
        """Each command of --help, and each of theirs, has its page, and its program's page names it; returns
        how many."""
        folder = self.unpacked / "usr/share/man/man1"
        page = "-".join(command)
        listed = re.search(r"^Commands:\n(.*?)(^$|\Z)", output_of(*command, "--help"), re.S | re.M)
        named = 0
        for name in re.findall(r"^  ([a-z][a-z-]*)", listed.group(1) if listed else "", re.M):
            if name == "help":
                continue
            full = f"{page}-{name}"
            require((folder / f"{full}.1.gz").is_file(), f"{full} has no manual page")
            text = gzip.decompress((folder / f"{page}.1.gz").read_bytes()).decode()
            require(full.replace("-", "\\-") + "(1)" in text, f"the page of {page} does not name {full}")
            named += 1 + self.pages_of(*command, name)
        return named

    def completions(self):
        share = self.unpacked / "usr/share"
        for program, word, wanted in COMPLETED:
            file = share / "bash-completion/completions" / program
            offered = output_of("bash", "-c", COMPLETE_BASH, "_", file, program, word).strip()
            require(offered == wanted, f"bash does not complete {program} {word}, it offers `{offered}`")
        for file in share.glob("zsh/vendor-completions/_biplane*"):
            run("zsh", "-n", file)
        fish = share / "fish/vendor_completions.d"
        for file in fish.glob("biplane*"):
            run("fish", "--no-execute", file)
        ask = f"source '{fish}/biplane-onboard.fish'; complete -C 'biplane-onboard rec'"
        offered = [line.split()[0] for line in output_of("fish", "--no-config", "-c", ask).splitlines()]
        require(
            offered == ["record", "recover"],
            f"fish does not complete biplane-onboard rec, it offers {offered}",
        )
        self.tally.ok("completions: bash and fish offer commands, zsh reads its files")

    def service(self):
        unit = self.root / "usr/lib/systemd/system/biplane-onboard.service"
        if self.is_installed:
            code, said = outcome_of("systemd-analyze", "verify", unit)
            require(code == 0 and not said, f"systemd-analyze verify has something to say: {said}")
            self.tally.ok("systemd-analyze verify is silent")
        limit = f"--threshold={LARGEST_EXPOSURE}"
        code, said = outcome_of("systemd-analyze", "security", "--offline=true", "--no-pager", limit, unit)
        require(code == 0, f"exposure above {LARGEST_EXPOSURE} tenths: {said}")
        self.tally.ok(re.sub(r"^[^A-Za-z]*", "", said.strip().splitlines()[-1]))
        run_check("package/check_udev.sh", self.root / "usr/lib/udev/rules.d/90-biplane.rules")
        self.tally.ok("udev rules are understood")
        run_check("package/check_service.py", unit, self.work / "service")
        self.tally.ok("the unit's command: ready, watched, killed, salvaged, started again, stopped")
        run_check("package/check_boot.sh", self.package, self.work / "boot")

    def ladder(self):
        """The hardware ladder, with mock devices; and without any, where it must fail."""
        ladder = self.root / "usr/libexec/biplane/ladder"
        for rung in RUNGS:
            words = [ladder, rung, "--mock", "--dir", self.work / "ladder" / rung, "--seconds"]
            # A machine that is busy with something else for a second may fail a rung: it has a second try.
            if subprocess.run(list(map(str, [*words, 8]))).returncode != 0:
                run(*words, 16)
        rig = self.work / "nothing.toml"
        rig.write_text(NO_DEVICES)
        for rung in RUNGS_WITHOUT_DEVICES:
            code, said = outcome_of(ladder, rung, "--rig", rig, "--dir", self.work / "nothing")
            has_failed = code == 1 and re.search(rf"^FAIL {rung}", said, re.M)
            require(has_failed, f"ladder {rung} without devices ended with {code}: {said}")
        self.tally.ok("every rung of the ladder passes with mock devices, and fails without")

    def purge(self):
        """Gone again; recordings stay."""
        if not self.is_installed:
            return
        RECORDINGS.mkdir(parents=True, exist_ok=True)
        kept = RECORDINGS / "run-0001-kept.mcap"
        kept.touch()
        output_of("dpkg", "--purge", "biplane", stderr=subprocess.STDOUT)
        self.is_installed = False
        left = [path for path in ("/etc/biplane", "/usr/bin/biplane") if Path(path).exists()]
        require(not left, f"purging left {left}")
        require(kept.exists(), "purging took a recording away")
        kept.unlink()
        RECORDINGS.rmdir()
        self.tally.ok("purged; a recording stays")

    def clean_up(self):
        """A package leaves its user behind; this check does not."""
        if self.is_installed:
            outcome_of("dpkg", "--purge", "biplane")
        if self.root == Path("/") and not self.had_user:
            outcome_of("userdel", "biplane")


def main():
    require(len(sys.argv) == 3, __doc__)
    package = Package(Path(sys.argv[1]).resolve(), fresh_folder(sys.argv[2]))
    try:
        package.archive()
        package.install()
        package.programs()
        package.manual_pages()
        package.completions()
        package.service()
        package.ladder()
        package.purge()
    finally:
        package.clean_up()
    package.tally.end()


main()
