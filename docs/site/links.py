#!/usr/bin/env python3
"""Copies the committed files that pages of a static site link to, and checks that links lead to files of it or to other sites.

links.py SITE REPOSITORY"""
import html.parser
import pathlib
import shutil
import subprocess
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


def copied(target, root, repository, committed):
    """Whether a file of the site could be copied from the repository, where it has the same path."""
    if not target.is_relative_to(root) or str(target.relative_to(root)) not in committed:
        return False
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(repository / target.relative_to(root), target)
    return True


def main():
    root, repository = (pathlib.Path(path).resolve() for path in sys.argv[1:])
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=repository, check=True, capture_output=True, text=True)
    committed = set(listed.stdout.split("\0"))
    checked, broken = 0, []
    for page in sorted(root.rglob("*.html")):
        for link in Links(page.read_text()).found:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc or not parts.path:
                continue
            checked += 1
            target = (page.parent / urllib.parse.unquote(parts.path)).resolve()
            if page.name != "404.html" and not target.exists() and not copied(target, root, repository, committed):
                broken.append(f"{page.relative_to(root)}: {link}")
    print(f"{checked} links", *broken, sep="\n")
    sys.exit(bool(broken) or checked == 0)


main()
