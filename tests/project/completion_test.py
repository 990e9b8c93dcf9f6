#!/usr/bin/env python3
"""The completion scripts in their shells: completion_test.py PROGRAM. Shells that are not installed are skipped."""
import os
import pathlib
import pty
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop()
PATH = f"{pathlib.Path(PROGRAM).resolve().parent}:/usr/bin:/bin"  # the scripts ask the program

BASH = """source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); compopt() { :; }
_merkel; printf '%s\\n' "${COMPREPLY[@]}" """
# The functions of zsh's completion system, as far as the script calls them.
ZSH = """compdef() { :; }; fpath=(${1:h}); autoload -Uz _merkel; shift; words=("$@"); CURRENT=$#
_describe() { local each; for each in ${choices}; do print -r -- ${each%%:*}; done; }
compadd() { print -rl -- $choices; }; _files() { print -l *(N); }; _merkel"""


def written(shell, folder):
    script = pathlib.Path(folder) / ("_merkel" if shell == "zsh" else f"merkel.{shell}")
    script.write_text(subprocess.run([PROGRAM, "completion", shell], check=True, capture_output=True, text=True).stdout)
    return script


def completed(shell, *words):
    """The words that a shell offers for the last of the given words, which may be empty."""
    with tempfile.TemporaryDirectory() as folder:
        script = written(shell, folder)
        (pathlib.Path(folder) / "press.csv").touch()
        if shell == "bash":
            command = ["bash", "--norc", "-c", BASH, "bash", script, "merkel", *words]
        elif shell == "zsh":
            command = ["zsh", "-f", "-c", ZSH, "zsh", script, "merkel", *words]
        else:
            command = ["fish", "--no-config", "-c", f"source {script}; complete -C 'merkel {' '.join(words)}'"]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder,
                              env={"PATH": PATH, "HOME": folder})
        assert not done.stderr, done.stderr
        found = {line.split("\t")[0] for line in done.stdout.split("\n") if line}
        return {word for word in found if word.startswith(words[-1])}


# Shells as a user starts them, with their own completion system.
TERMINALS = {
    "bash": (["bash", "--noprofile", "--rcfile", "rc", "-i"], "source merkel.bash; PS1='READY '; merkel() { echo \"$*\" >got; }"),
    "zsh": (["zsh", "-d", "-i"], "fpath=($PWD $fpath); autoload -Uz compinit; compinit -u -d dump; PS1='READY '; merkel() { echo \"$*\" >got; }"),
}


def typed(shell, keys):
    """The arguments that merkel receives after these keys in a terminal."""
    command, rc = TERMINALS[shell]
    with tempfile.TemporaryDirectory() as folder:
        written(shell, folder)
        (pathlib.Path(folder) / "press.csv").touch()
        for name in ["rc", ".zshrc"]:
            (pathlib.Path(folder) / name).write_text(rc + "\n")
        ours, theirs = pty.openpty()
        with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, cwd=folder, start_new_session=True,
                              env={"PATH": PATH, "HOME": folder, "ZDOTDIR": folder, "TERM": "dumb"}):
            os.close(theirs)
            shown = b""
            while b"READY " not in shown:
                shown += os.read(ours, 4096)
            os.write(ours, keys.encode() + b"\nexit\n")
            try:
                while os.read(ours, 4096):
                    pass
            except OSError:  # the shell has closed its terminal
                pass
        os.close(ours)
        return (pathlib.Path(folder) / "got").read_text().strip()


SHELLS = [shell for shell in ["bash", "fish", "zsh"] if shutil.which(shell)]


class Completion(unittest.TestCase):
    def test_offers_commands(self):
        for shell in SHELLS:
            with self.subTest(shell=shell):
                self.assertEqual(completed(shell, "re"), {"record", "replay"})
                self.assertEqual(completed(shell, "inspect", "se"), {"session"})

    def test_offers_the_options_of_a_command(self):
        for shell in SHELLS:
            with self.subTest(shell=shell):
                self.assertEqual(completed(shell, "run", "paper", "--du"), {"--duration-s"})
                self.assertIn("--json", completed(shell, "self-test", "--"))
                self.assertNotIn("--json", completed(shell, "completion", "--"))

    def test_offers_presets_and_files_as_a_scene(self):
        for shell in SHELLS:
            with self.subTest(shell=shell):
                self.assertLessEqual({"paper", "press.csv"}, completed(shell, "run", "p"))
                self.assertEqual(completed(shell, "run", "lett"), {"letter", "letter_scanned"})
                self.assertEqual(completed(shell, "completion", "z"), {"zsh"})

    def test_offers_files_as_the_value_of_an_option(self):
        for shell in SHELLS:
            with self.subTest(shell=shell):
                self.assertIn("press.csv", completed(shell, "run", "--record", "pr"))
                self.assertEqual(completed(shell, "run", "--duration-s", "p"), set())

    def test_tab_completes_in_a_terminal(self):
        for shell in TERMINALS.keys() & SHELLS:
            with self.subTest(shell=shell):
                self.assertEqual(typed(shell, "merkel reco\t--dur\t2 pre\t"), "record --duration-s 2 press.csv")

    def test_each_command_has_a_row(self):
        listed = subprocess.run([PROGRAM, "--help"], check=True, capture_output=True, text=True).stdout
        commands = {line.split()[0] for line in listed.partition("Subcommands:\n")[2].partition("\n\n")[0].split("\n")
                    if line.startswith("  ") and not line.startswith("   ")}
        self.assertGreater(len(commands), 15)
        for shell in SHELLS:
            with self.subTest(shell=shell):
                self.assertEqual(completed(shell, ""), commands)

    def test_an_unknown_shell_is_refused(self):
        done = subprocess.run([PROGRAM, "completion", "tcsh"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("bash, fish or zsh", done.stderr)


if __name__ == "__main__":
    unittest.main()
