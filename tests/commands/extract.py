"""Every command line that a README or guide shows."""
import os
import re
from dataclasses import dataclass

# What a command line of ours begins with. Names of scripts and programs are not listed: a new one is found by what it
# is called.
OURS = re.compile(r"^((?:\./deploy/)?run-(?:wall|tests|bench|drill)|\./deploy/[\w./-]+|deploy/[\w./-]*/[\w-]+\.py|"
                  r"(?:\./|[\w./-]*/)?(?:bin/)?(?:tessera|example)-[\w-]+|build/bin/\w+|\./bin/\w+|ctest|cmake)(\s|$)")
ASSIGNMENT = re.compile(r"^[A-Za-z_]\w*=\S*\s+")
SKIPPED_FOLDERS = {".git", "out", "node_modules"}


@dataclass(frozen=True)
class Line:
    file: str  # from the root
    number: int
    text: str  # with one space between words; a block that is one script: its lines

    def __str__(self):
        return f"{self.file}:{self.number}: {self.text}"


def documents(root):
    """All Markdown files, in order."""
    for folder, folders, files in os.walk(root, followlinks=True):
        folders[:] = sorted(f for f in folders if f not in SKIPPED_FOLDERS and not f.startswith("build"))
        for name in sorted(files):
            if name.endswith(".md"):
                yield os.path.relpath(os.path.join(folder, name), root)


def is_command(text):
    while ASSIGNMENT.match(text):
        text = ASSIGNMENT.sub("", text, count=1)
    return OURS.match(text) is not None


def without_comment(text):
    """`# …` behind a command is for the reader."""
    return re.sub(r"\s+#(\s.*)?$", "", text)


def one_space(text):
    return " ".join(text.split())


def blocks_and_prose(text):
    """("code", number of the first line, lines) and ("prose", …), paragraph by paragraph. Fenced blocks are drawings
    here."""
    lines = text.split("\n")
    i = 0
    while i < len(lines):
        if lines[i].startswith("```"):
            end = i + 1
            while end < len(lines) and not lines[end].startswith("```"):
                end += 1
            yield "fenced", i + 2, lines[i + 1:end]
            i = end + 1
        elif lines[i].startswith("    ") and (i == 0 or not lines[i - 1].strip()):
            end = i
            while end < len(lines) and lines[end].startswith("    "):
                end += 1
            yield "code", i + 1, [line[4:] for line in lines[i:end]]
            i = end
        elif lines[i].strip():
            end = i
            # A row of a table, or an item of a list, is a paragraph of its own.
            while end < len(lines) and lines[end].strip() and not lines[end].startswith("```") and (
                end == i or not re.match(r"\s*([-*] |\||\d+\. )", lines[end])):
                end += 1
            yield "prose", i + 1, lines[i:end]
            i = end
        else:
            i += 1


def of_code(file, first, lines):
    # A block with functions or loops is one script.
    if any(re.match(r"(for |while |\w+\(\))", line) for line in lines):
        yield Line(file, first, "\n".join(lines))
        return
    pending, number = "", 0
    for offset, line in enumerate(lines):
        number = number or first + offset
        # Two columns side by side: services of systemd.
        starts = re.findall(r"ExecStart=(\S+)", line)
        for start in starts:
            yield Line(file, first + offset, f"ExecStart={os.path.basename(start)}")
        if starts:
            pending, number = "", 0
            continue
        text = pending + line.strip()
        if text.endswith("\\"):
            pending = text[:-1]
            continue
        pending = ""
        if is_command(text):
            yield Line(file, number, one_space(without_comment(text)))
        number = 0


def of_prose(file, first, lines):
    text = "\n".join(lines)
    for span in re.finditer(r"(?<!`)`([^`]+)`(?!`)", text):
        words = one_space(span.group(1))
        if not is_command(words):
            continue
        # The name of a program alone is no command line, that of a script is.
        if " " not in words and not words.startswith("./deploy/run-") and words != "./deploy/install":
            continue
        if words.startswith("run-"):
            words = "./deploy/" + words
        yield Line(file, first + text.count("\n", 0, span.start()), words)


def command_lines(root):
    """All of them, in the order of the documents."""
    for file in documents(root):
        with open(os.path.join(root, file), encoding="utf-8") as document:
            text = document.read()
        for kind, first, lines in blocks_and_prose(text):
            if kind == "code":
                yield from of_code(file, first, lines)
            elif kind == "prose":
                yield from of_prose(file, first, lines)


def programs_named(root):
    """(name, where) of each program that a document names, in a command line or not; each once."""
    found = {}
    for file in documents(root):
        with open(os.path.join(root, file), encoding="utf-8") as document:
            for number, line in enumerate(document, 1):
                for name in re.findall(r"(?:^    |[`/])((?:tessera|example)-[a-z]+(?:-[a-z]+)*)(?=[ `])", line):
                    found.setdefault(name, f"{file}:{number}")
    return list(found.items())


def options_of_help(text):
    """Long options that a --help lists, in its order."""
    found = []
    for line in text.split("\n"):
        match = re.match(r"\s+(?:-\w,\s*)?(--[a-z][\w-]*)", line)
        if match and match.group(1) not in found:
            found.append(match.group(1))
    return found
