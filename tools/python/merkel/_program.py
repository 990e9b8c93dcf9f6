"""The command merkel of a wheel."""
import sys

from ._merkel import _main


def main():
    sys.exit(_main(["merkel", *sys.argv[1:]], sys.argv[0]))
