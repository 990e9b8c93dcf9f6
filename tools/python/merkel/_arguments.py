"""Checks of arguments: a wrong one is reported by its name, as merkel.Error."""
import functools
import inspect
import operator
import re
import reprlib

from ._merkel import Error

# What pybind11 names the type of an argument, what a user calls it, and whether a value has it.
KINDS = {
    "float": ("a number", lambda value: hasattr(value, "__float__") or hasattr(value, "__index__")),
    "int": ("a whole number from 0 on", lambda value: hasattr(value, "__index__") and operator.index(value) >= 0),
    "bool": ("True or False", lambda value: isinstance(value, bool)),
    "str": ("a text", lambda value: isinstance(value, str)),
    "list[str]": ("a list of texts", lambda value: not isinstance(value, str) and hasattr(value, "__iter__")
                  and all(isinstance(each, str) for each in value)),
    "os.PathLike": ("a path", lambda value: isinstance(value, (str, bytes)) or hasattr(value, "__fspath__")),
}


class Parameter:
    def __init__(self, text):
        name, _, kind = text.partition(" = ")[0].partition(": ")
        self.name, self.needed = name, " = " not in text
        optional = re.fullmatch(r"Optional\[(.*)\]", kind)
        kind = (optional.group(1) if optional else kind).replace("List[", "list[")  # pybind11 before 2.12
        self.words, self.fits = KINDS.get(kind, ("", lambda value: True))
        if optional:
            self.words, fits = self.words + " or None", self.fits
            self.fits = lambda value: value is None or fits(value)


def parameters(signature):
    """The parameters by position and those by name only, of a signature as pybind11 writes it."""
    texts = re.split(r", (?=\*|\w+: )", re.match(r"\w+\((.*)\)", signature).group(1))
    texts = [text for text in texts if text and not text.startswith("self")]
    star = texts.index("*") if "*" in texts else len(texts)
    return [Parameter(text) for text in texts[:star]], [Parameter(text) for text in texts[star + 1:]]


def fault_of(name, by_position, by_name, arguments, keywords):
    """Why these arguments do not fit, in a sentence."""
    every = {each.name: each for each in by_position + by_name}
    known = ", ".join(every)
    for each in keywords:
        if each not in every:
            return f"{name} has no keyword {each}" + (f"; the known ones are {known}" if known else "")
    if len(arguments) > len(by_position):
        return (f"{name} takes {len(by_position)} arguments without a name, but got {len(arguments)}"
                + (f": name the others: {', '.join(each.name + '=' for each in by_name)}" if by_name else ""))
    given = dict(zip((each.name for each in by_position), arguments))
    for each in every.values():
        if each.needed and each.name not in given and each.name not in keywords:
            return f"{name} needs {each.name}: {each.words}" if each.words else f"{name} needs {each.name}"
    for each, value in {**given, **keywords}.items():
        if not every[each].fits(value):
            return f"{name}: {each} must be {every[each].words}, but is {reprlib.repr(value)} ({type(value).__name__})"
    return f"{name}: an argument is out of range: {reprlib.repr({**given, **keywords})}"


def checked(function, name=None, is_method=True):
    """Reports wrong arguments as the program reports a wrong key of a scene: by name, as merkel.Error."""
    signature = (function.__doc__ or "").partition("\n")[0]
    name = name or function.__name__ + "()"

    @functools.wraps(function)
    def call(*arguments, **keywords):
        try:
            return function(*arguments, **keywords)
        except TypeError as error:
            if not re.search("incompatible (function|constructor) arguments", str(error)):
                raise
        raise Error(fault_of(name, *parameters(signature), arguments[is_method:], keywords)) from None
    return call


def whole_or_none(**arguments):
    """Reports an argument that is neither None nor a whole number from 1 on."""
    for name, value in arguments.items():
        if value is not None and (not isinstance(value, int) or value < 1):
            raise Error(f"{name} must be a whole number of at least 1, not {value!r}")


def checked_by_signature(function):
    """Reports a wrong or missing argument of a function of Python, as checked() does of the others."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def call(*arguments, **keywords):
        try:
            signature.bind(*arguments, **keywords)
        except TypeError as error:
            raise Error(f"{function.__name__}() has {error}; its arguments are {', '.join(signature.parameters)}") from None
        return function(*arguments, **keywords)
    return call
