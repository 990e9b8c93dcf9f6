"""The page of the Python module, from its stubs (.pyi)."""
import ast
import textwrap


def signature(function, own):
    arguments = function.args
    if own and arguments.args and arguments.args[0].arg == "self":
        arguments.args = arguments.args[1:]
    returns = f" -> {ast.unparse(function.returns)}" if function.returns else ""
    return f"{function.name}({ast.unparse(arguments)}){returns}"


def entry(directive, head, docstring, options=(), inside=""):
    lines = [f".. py:{directive}:: {head}", *(f"   :{option}" for option in options), ""]
    if docstring:
        lines += [textwrap.indent(docstring, "   "), ""]
    return "\n".join(lines) + "\n" + textwrap.indent(inside, "   ")


def member(node):
    if isinstance(node, ast.AnnAssign):
        return entry("attribute", node.target.id, None, [f"type: {ast.unparse(node.annotation)}"])
    if not isinstance(node, ast.FunctionDef):
        return ""
    names = [ast.unparse(decorator) for decorator in node.decorator_list]
    if f"{node.name}.setter" in names:
        return ""
    docstring = ast.get_docstring(node)
    if "property" in names:
        return entry("property", node.name, docstring, [f"type: {ast.unparse(node.returns)}"])
    options = ["staticmethod:"] if "staticmethod" in names else []
    return entry("method", signature(node, True), docstring, options)


def page(stubs):
    """reStructuredText for every class and function of a stub file."""
    module = ast.parse(stubs.read_text())
    text = f"Python\n======\n\n.. py:module:: merkel\n\n{ast.get_docstring(module)}\n\n"
    for node in module.body:
        if isinstance(node, ast.ClassDef):
            inside = "".join(member(child) for child in node.body)
            text += entry("class", node.name, ast.get_docstring(node), inside=inside)
        elif isinstance(node, ast.FunctionDef):
            text += entry("function", signature(node, False), ast.get_docstring(node))
    return text
