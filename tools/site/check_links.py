"""Every link inside a built site must have a target: check_links.py FOLDER. Exit code 1, with the links that have none."""
import html.parser
import pathlib
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.anchors = set(), set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("id", "name"):
                self.anchors.add(value)
            if name in ("href", "src") and value is not None:
                self.links.add(value)


def broken(folder):
    """"PAGE: LINK" for every link without a target."""
    pages = {file.resolve(): Page(file.read_text()) for file in sorted(folder.rglob("*.html"))}
    for file, page in pages.items():
        for link in sorted(page.links):
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else file
            if target.is_dir():
                target = target / "index.html"
            anchors = pages[target].anchors if target in pages else set()
            missing = parts.fragment and target in pages and urllib.parse.unquote(parts.fragment) not in anchors
            if not target.exists() or missing:
                yield f"{file.relative_to(folder.resolve())}: {link}"


if __name__ == "__main__":
    found = list(broken(pathlib.Path(sys.argv[1])))
    print("\n".join(f"broken link: {each}" for each in found), end="\n" if found else "")
    sys.exit(1 if found else 0)
