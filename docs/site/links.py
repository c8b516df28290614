#!/usr/bin/env python3
"""Checks that links of a static site lead to files of it, or to other sites: links.py FOLDER."""
import html.parser
import pathlib
import sys
import urllib.parse


class Links(html.parser.HTMLParser):
    """Targets of links and sources of pictures."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        named = {"a": "href", "img": "src", "link": "href", "script": "src"}.get(tag)
        self.found += [value for name, value in attributes if name == named and value]


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    checked, broken = 0, []
    for page in sorted(root.rglob("*.html")):
        for link in Links(page.read_text()).found:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc or not parts.path:
                continue
            checked += 1
            target = (page.parent / urllib.parse.unquote(parts.path)).resolve()
            if page.name != "404.html" and not target.exists():
                broken.append(f"{page.relative_to(root)}: {link}")
    print(f"{checked} links", *broken, sep="\n")
    sys.exit(bool(broken) or checked == 0)


main()
