"""Evaluates the inverse kinematics that a LaTeX article prints, from the LaTeX text alone.

The file ``inverse.tex`` contains definitions ``name &= formula``. The file ``symbols.tex`` defines
the short symbols. A recursive-descent parser evaluates each formula numerically.
"""

import math
import re

TOKEN = re.compile(r"\\[A-Za-z]+|\\.|\d+(?:\.\d+)?|[A-Za-z]|[-+/,()\[\]{}_^|=&]|\S")
SILENT = {"\\left", "\\right", "\\quad", "\\allowdisplaybreaks", "\\,", "\\ ", "{}"}
FUNCTIONS = {"\\cos": math.cos, "\\sin": math.sin, "\\tan": math.tan, "\\arctan": math.atan}
ACCENTS = {"\\hat", "\\tilde", "\\check", "\\breve", "\\bar", "\\mathcal", "\\mathrm", "\\mathit"}


class UnknownSymbolError(KeyError):
    """Error raised for a printed symbol that is used without a previous definition."""


class Formula:
    """A LaTeX formula that is evaluated numerically from left to right.

    Args:
        tex: LaTeX text of the formula.
        known: Values of the symbols, keyed by their LaTeX names without spaces.
    """

    def __init__(self, tex, known):
        self.tokens = [t for t in TOKEN.findall(tex.replace("{}", " ")) if t not in SILENT]
        self.known, self.at = known, 0

    def value(self):
        """Return the value of the printed formula."""
        found = self.sum()
        assert self.at == len(self.tokens), self.tokens[self.at :]
        return found

    def peek(self):
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self, wanted=None):
        token = self.peek()
        assert wanted is None or token == wanted, (wanted, self.tokens[self.at :])
        self.at += 1
        return token

    def sum(self):
        total = 0.0
        sign = 1.0
        if self.peek() == "-":
            self.take()
            sign = -1.0
        total += sign * self.product()
        while self.peek() in ("+", "-"):
            sign = 1.0 if self.take() == "+" else -1.0
            total += sign * self.product()
        return total

    def product(self):
        total = self.power()
        while self.peek() not in ("", "+", "-", ",", ")", "]", "}", "|"):
            if self.peek() == "/":
                self.take()
                total /= self.power()
            elif self.peek() == "\\cdot":
                self.take()
            else:
                total *= self.power()
        return total

    def power(self):
        base = self.factor()
        if self.peek() == "^":
            self.take()
            base **= self.group()
        return base

    def group(self):
        if self.peek() != "{":
            return self.factor()
        self.take("{")
        found = self.sum()
        self.take("}")
        return found

    def arguments(self):
        found = [self.sum()]
        while self.peek() == ",":
            self.take()
            found.append(self.sum())
        return found

    def factor(self):
        token = self.peek()
        if re.match(r"\d", token):
            return float(self.take())
        if token in ("(", "["):
            self.take()
            found = self.sum()
            self.take(")" if token == "(" else "]")
            return found
        if token == "|":
            self.take()
            found = abs(self.sum())
            self.take("|")
            return found
        if token in ("\\frac", "\\tfrac"):
            self.take()
            return self.group() / self.group()
        if token == "\\sqrt":
            self.take()
            # The LaTeX article states that a square root of a negative number is read as 0.
            # Radicands are negative beyond the boundary of the workspace.
            return math.sqrt(max(self.group(), 0.0))
        if token == "\\pi":
            self.take()
            return math.pi
        if token == "\\ldots":
            self.take()
            return 1.0
        if token in FUNCTIONS:
            return self.function(FUNCTIONS[self.take()])
        if token == "\\operatorname":
            self.take()
            name = self.word()
            if self.peek() != "(":
                return math.copysign(1.0, self.symbol())
            self.take("(")
            values = self.arguments()
            self.take(")")
            return {"atan2": math.atan2, "sign": lambda x: math.copysign(1.0, x)}[name](*values)
        return self.symbol()

    def word(self):
        self.take("{")
        letters = []
        while self.peek() != "}":
            letters.append(self.take())
        self.take("}")
        return "".join(letters)

    def function(self, f):
        power = 1
        if self.peek() == "^":
            self.take()
            power = self.group()
        if self.peek() == "(":
            self.take()
            found = f(self.sum())
            self.take(")")
            return found**power
        return f(self.symbol()) ** power

    def symbol(self):
        name = self.letter()
        if self.peek() == "'":
            name += self.take()
        if self.peek() == "_":
            name += self.take() + self.index()
        if name not in self.known:
            raise UnknownSymbolError(name)
        return self.known[name]

    def letter(self):
        token = self.take()
        if token in ACCENTS:
            return token + self.index()
        assert re.match(r"[A-Za-z]$|\\[A-Za-z]+$", token), (token, self.tokens[self.at - 3 :])
        return token

    def index(self):
        depth, parts = 0, []
        while True:
            token = self.take()
            depth += (token == "{") - (token == "}")
            parts.append(token)
            if depth == 0:
                return "".join(parts)


def spelled(tex):
    """Return the LaTeX name of a symbol with all spaces removed."""
    return "".join(t for t in TOKEN.findall(tex.replace("{}", " ")) if t not in SILENT)


def displays(text):
    """Return (left side, right side) of each displayed equation."""
    found = []
    for display in re.findall(r"\\begin\{align\*\}(.*?)\\end\{align\*\}", text, re.DOTALL):
        body = re.sub(r"\\\\\*?\s*&\\quad", " ", display)
        for row in re.split(r"\\\\\*?", body):
            parts = re.split(r",\s*&(?!\\quad)", row)
            for part in parts:
                if "&=" in part:
                    left, right = part.split("&=", 1)
                    found.append((spelled(left), right.strip().rstrip(".,")))
    return found


def angles(text):
    """Return (cosine name, sine name, angle) for each entry of the symbol table."""
    found = []
    for row in re.findall(r"^(\$.*?) \\\\$", text, re.MULTILINE):
        cells = [cell.strip() for cell in row.split("&")]
        for c, s, of in zip(cells[::3], cells[1::3], cells[2::3], strict=False):
            if c and ("c" in c or "C" in c) and of:
                found.append((spelled(c.strip("$")), spelled(s.strip("$")), of.strip("$")))
    return found


class Known(dict):
    """Symbol values.

    A cosine or sine is computed from its angle at its first use.

    Attributes:
        angles: (LaTeX of the angle, cosine or sine function), keyed by the short symbol of the
            cosine or sine.
        sums: Names of the angle sums in the solution steps, keyed by the LaTeX text of each sum.
    """

    def __init__(self, values, angles, sums):
        super().__init__(values)
        self.angles, self.sums = angles, sums

    def __contains__(self, name):
        return super().__contains__(name) or name in self.angles

    def __missing__(self, name):
        angle, f = self.angles[name]
        total = self.sums.get(spelled(angle))
        if total is not None and super().__contains__(total):
            value = self[total]
        else:
            value = Formula(angle, self).value()
        self[name] = f(value)
        return self[name]


class PrintedInverse:
    """Solution steps of an inverse kinematics function, parsed from the text of a LaTeX article.

    Attributes:
        is_whole: Whether every solution step has a formula and every number has full precision.
        signs: Names of the sign symbols, in the order of the solution slots.
    """

    def __init__(self, fragments):
        text = fragments["inverse.tex"]
        first = re.search(r"\\paragraph\{\\texttt\{(\w+)", text)
        if first:
            text = re.split(r"\\paragraph", text)[1]
        self.symbols = fragments["symbols.tex"]
        self.parameters = fragments["parameters.tex"]
        rounded = re.search(r"^\$\\kappa_\S+ &  & ", self.symbols, re.MULTILINE)
        self.is_whole = r"\ldots" not in text + self.symbols and "Steps" not in text
        self.is_whole = self.is_whole and rounded is None
        self.equations = displays(text)
        self.signs = [spelled(s) for s in re.findall(r"^\$(\\sigma_\{\d+\})\$", text, re.MULTILINE)]
        found = re.search(r"with its entries \$(.*?)_\{11\}, \\dots, (.*?)_\{z\}\$", text)
        self.letters = found.groups() if found else None
        heads = re.findall(r"\\textbf\{Step \d+: \$(.*?)\$\}", text)
        self.sums = {}
        for name, total in (head.split(" = ") for head in heads if " = " in head):
            self.sums[spelled(total)] = spelled(name)

    def constants(self):
        known = {}
        table = self.parameters.partition("parameter & value")[2]
        for row in re.findall(r"^(\$.*?) \\\\$", table, re.MULTILINE):
            name, value, *_ = row.split(" & ")
            value = re.match(r"\$(.*?)\$", value)[1].split(r"\approx")[0]
            known[spelled(name.strip("$"))] = Formula(value, {}).value()
        return known

    def solve(self, T, given, signs):
        """Return the values of all symbols for a pose (4, 4), given input symbols and signs."""
        rotation, position = self.letters
        known = self.constants() | given | dict(zip(self.signs, map(float, signs), strict=True))
        for i in range(3):
            known |= {f"{rotation}_{{{i + 1}{j + 1}}}": T[i, j] for j in range(3)}
            known[f"{position}_{{{'xyz'[i]}}}"] = T[i, 3]
        own = {}
        for c, s, of in angles(self.symbols):
            own |= {c: (of, math.cos), s: (of, math.sin)}
        values = Known(known, own, self.sums)
        table = self.symbols.partition("constant & ")[2]
        for row in re.findall(r"^(\$.*?) \\\\$", table, re.MULTILINE):
            cells = row.split(" & ")
            for k in range(0, len(cells) - 2, 3):
                if cells[k].strip():
                    name, exact = spelled(cells[k].strip("$ ")), cells[k + 1].strip("$ ")
                    values[name] = Formula(exact, values).value()
        for name, formula in displays(self.symbols):
            values[name] = Formula(formula, values).value()
        for name, formula in self.equations:
            assert not super(Known, values).__contains__(name), f"{name} is defined twice"
            values[name] = chosen(formula, values)
        return values


def chosen(formula, values):
    """Evaluate a formula, or a conditional with two formulas."""
    parts = re.fullmatch(r"(.*?) \\text\{ if \} (.*?) \\ge 0, \\text\{ else \} (.*)", formula)
    if parts is None:
        return Formula(formula, values).value()
    one, condition, other = parts.groups()
    return Formula(one if Formula(condition, values).value() >= 0 else other, values).value()
