"""The command `python -m merkel.trials`; as a module, the function merkel.trials()."""
import sys
import types

from merkel._trials import main, trials


class _Callable(types.ModuleType):
    """Stays the function, also where this module is imported by its name."""

    def __call__(self, *arguments, **options):
        return trials(*arguments, **options)


if __name__ == "__main__":
    sys.exit(main())
sys.modules[__name__].__class__ = _Callable
