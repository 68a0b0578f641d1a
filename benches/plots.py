"""Line plots and bar plots as SVG, readable on light and dark pages."""

from html import escape
from math import ceil, floor, log10

COLOURS = ("#2b6cb0", "#c05621", "#2f855a", "#805ad5", "#b83280")
INK, FAINT = "#4a5568", "#cbd5e0"
WIDTH, HEIGHT = 720, 360
LEFT, RIGHT, TOP, BOTTOM = 62, 196, 40, 46


class Svg:
    """Elements of a picture."""

    def __init__(self, title: str, height: int = HEIGHT) -> None:
        self.height = height
        self.parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
            f'width="{WIDTH}" height="{height}" font-family="sans-serif" font-size="12" fill="{INK}">',
            f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
        ]
        self.text(LEFT, 22, title, size=14)

    def text(self, x: float, y: float, text: str, anchor: str = "start", size: int = 12) -> None:
        self.parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}">'
            f"{escape(text)}</text>"
        )

    def line(self, x1: float, y1: float, x2: float, y2: float, colour: str = FAINT) -> None:
        self.parts.append(
            f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}"/>'
        )

    def rectangle(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        self.parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" '
            f'fill="{colour}"/>'
        )

    def path(self, points: list[tuple[float, float]], colour: str, dashed: bool) -> None:
        dash = ' stroke-dasharray="5 4"' if dashed else ""
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.parts.append(
            f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>'
        )
        for x, y in points:
            self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"/>')

    def end(self) -> str:
        return "\n".join([*self.parts, "</svg>\n"])


def ticks(most: float) -> list[float]:
    """Round numbers from 0 to at least `most`."""
    step = 10 ** floor(log10(most / 4))
    step = next(step * k for k in (1, 2, 5, 10) if most / (step * k) <= 6)
    return [step * k for k in range(ceil(most / step) + 1)]


def lines(title: str, x_label: str, y_label: str, series: dict[str, list[tuple[float, float]]]) -> str:
    """Curves over a logarithmic axis; names that end in `1 thread` are dashed."""
    svg = Svg(title)
    xs = sorted({x for points in series.values() for x, _ in points})
    marks = ticks(max(y for points in series.values() for _, y in points))
    low, high = log10(xs[0]) - 0.15, log10(xs[-1]) + 0.15
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM

    def place(x: float, y: float) -> tuple[float, float]:
        across = LEFT + (right - LEFT) * (log10(x) - low) / (high - low)
        return across, bottom - (bottom - TOP) * y / marks[-1]

    for mark in marks:
        y = place(xs[0], mark)[1]
        svg.line(LEFT, y, right, y)
        svg.text(LEFT - 8, y + 4, f"{mark:g}", "end")
    for x in xs:
        svg.text(place(x, 0)[0], bottom + 17, f"{x:,.0f}".replace(",", "\u202f"), "middle")
    svg.text((LEFT + right) / 2, HEIGHT - 10, x_label, "middle")
    svg.text(8, TOP - 6, y_label)
    for number, (name, points) in enumerate(series.items()):
        colour = COLOURS[number // 2 % len(COLOURS)]
        svg.path([place(x, y) for x, y in points], colour, name.endswith("1 thread"))
        y = TOP + 12 + 20 * number
        dashes = ((0, 24),) if not name.endswith("1 thread") else ((0, 9), (14, 24))
        for start, stop in dashes:
            svg.rectangle(right + 14 + start, y - 5, stop - start, 2, colour)
        svg.text(right + 44, y, name)
    return svg.end()


def bars(title: str, unit: str, rows: list[tuple[str, float, str]]) -> str:
    """Horizontal bars with a label, a value and a group each; groups have colours."""
    height = TOP + 24 * len(rows) + 34
    svg = Svg(title, height)
    left, right = 275, WIDTH - 70
    marks = ticks(max(value for _, value, _ in rows))
    groups = list(dict.fromkeys(group for _, _, group in rows))
    for mark in marks:
        x = left + (right - left) * mark / marks[-1]
        svg.line(x, TOP, x, TOP + 24 * len(rows))
        svg.text(x, height - 12, f"{mark:g}", "middle")
    svg.text(right + 12, height - 12, unit)
    for number, (name, value, group) in enumerate(rows):
        y = TOP + 24 * number + 4
        svg.text(left - 8, y + 13, name, "end")
        width = (right - left) * value / marks[-1]
        svg.rectangle(left, y, width, 17, COLOURS[groups.index(group) % len(COLOURS)])
        svg.text(left + width + 6, y + 13, f"{value:.3g}")
    return svg.end()
