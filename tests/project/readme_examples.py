"""The C++ examples of the documents compile exactly as they are printed: readme_examples.py SOURCE_FOLDER COMPILER."""
import pathlib
import re
import subprocess
import sys

folder, compiler = pathlib.Path(sys.argv[1]), sys.argv[2]
documents = [folder / "README.md", folder / ".github/CONTRIBUTING.md",
             *(path for top in ("core", "drivers", "realtime", "tools") for path in (folder / top).rglob("*.md"))]
examples = [(path, text) for path in documents
            for text in re.findall(r"^```cpp\n(.*?)^```$", path.read_text(), re.MULTILINE | re.DOTALL)]
if not examples:
    sys.exit("no document has a C++ example: the pattern is wrong")
failed = 0
for path, text in examples:
    compiled = subprocess.run([compiler, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", f"-I{folder}",
                               "-isystem", "/usr/include/eigen3", "-xc++", "-"], input=text, text=True, capture_output=True)
    if compiled.returncode != 0:
        print(f"an example of {path.relative_to(folder)} does not compile:\n{compiled.stderr}")
        failed += 1
print(f"{len(examples)} examples, {failed} do not compile")
sys.exit(failed > 0)
