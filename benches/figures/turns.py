"""Load fraction against the tip of a two-coil rod, through the turn of the load: docs/turns.svg. NumPy alone.

Five samples whose folds `tests/engines/turns.rs` knows. The curve is followed by its arclength with a program of its own: RK4, columns by
differences, bordered Newton steps (C1 and C2 in src/EQUATIONS.md). Usage: python3 benches/figures/turns.py [FILE]
"""
import math
import sys

import numpy as np

EI = 8e6 * math.pi / 4 * (0.8e-3**4 - 0.5e-3**4)
GJ = EI / 1.48
B = np.array([0.0, 1.5, 0.0])
PER_AMPERE = np.array([50 * 20e-6, 50 * 20e-6, 100 * 3e-6])
RIGID = 0.010
TUBES = [0.060, 0.025]
UNIT = GJ / (sum(TUBES) + 2 * RIGID)
STEPS = 12
SAMPLES = [
    [-52.9, -36.0, 60.0, 69.8, -35.4, 53.6],
    [69.5, -19.8, 10.7, -59.5, -35.7, -50.5],
    [-84.9, -27.9, 90.4, 95.1, -14.5, 61.5],
    [82.9, 1.9, 83.3, -57.0, -36.1, 6.5],
    [98.9, -24.0, -43.6, -80.1, -91.4, 15.0],
]


def rotate(q, v):
    c = np.cross(q[1:], v)
    return v + 2 * (q[0] * c + np.cross(q[1:], c))


def times(q, u):
    w = -(q[1:] @ u)
    return np.concatenate([[w], q[0] * u + np.cross(q[1:], u)])


def shoot(m0, load, dipoles):
    """Tip and residual: no forces, so the moment changes at coils alone."""
    p, q, m = np.zeros(3), np.array([1.0, 0, 0, 0]), m0 * UNIT

    def slope(q):
        back = q * np.array([1.0, -1, -1, -1])
        u = rotate(back, m) / np.array([EI, EI, GJ])
        return rotate(q, np.array([0.0, 0, 1])), 0.5 * times(q, u)

    for length, dipole in zip(TUBES, dipoles):
        h = length / STEPS
        for _ in range(STEPS):
            a = slope(q)
            b = slope(q + h / 2 * a[1])
            c = slope(q + h / 2 * b[1])
            d = slope(q + h * c[1])
            p = p + h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
            q = q + h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
            q = q / np.linalg.norm(q)
        p = p + RIGID * rotate(q, np.array([0.0, 0, 1]))
        m = m - np.cross(rotate(q, load * dipole), B)
    return p, m / UNIT


def look(y, dipoles):
    """Tip, residual, and its derivatives by base moment and load."""
    tip, r = shoot(y[:3], y[3], dipoles)
    columns = [(shoot(y[:3] + 1e-6 * e, y[3], dipoles)[1] - r) / 1e-6 for e in np.eye(3)]
    columns.append((shoot(y[:3], y[3] + 1e-6, dipoles)[1] - r) / 1e-6)
    return tip, r, np.array(columns).T


def trace(currents, past=14):
    """Points (tip over length, load) of a curve, `past` of them beyond its turn, and where it turns."""
    dipoles = [PER_AMPERE * np.array(currents[:3]) * 1e-3, PER_AMPERE * np.array(currents[3:]) * 1e-3]
    y, points, turn, beyond, step = np.zeros(4), [], None, 0, 0.05
    tip, _, M = look(y, dipoles)
    ahead = np.array([0.0, 0, 0, 1])
    while beyond < past and len(points) < 400:
        points.append((tip, y[3]))
        _, _, M = look(y, dipoles)
        tangent = np.linalg.svd(M)[2][3]
        tangent *= np.sign(tangent @ ahead)
        new = y + step * tangent
        for _ in range(5):
            tip, r, M = look(new, dipoles)
            new = new - np.linalg.solve(np.vstack([M, tangent]), np.append(r, 0.0))
        if turn is None and new[3] < y[3]:
            turn = len(points) - 1
        beyond += turn is not None
        ahead, y, step = new - y, new, min(1.2 * step, 0.12)
        tip = shoot(y[:3], y[3], dipoles)[0]
    return points, turn


def main():
    width, height, left, low = 720, 420, 64, 52
    length = sum(TUBES) + 2 * RIGID
    colours = ["#1b6ca8", "#c4572e", "#3b8f5a", "#8a5aa8", "#a8841b"]
    x = lambda away: left + (width - left - 20) * away / 0.9
    y = lambda load: height - low - (height - low - 20) * load
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="13">',
           f'<rect width="{width}" height="{height}" fill="white"/>']
    for k in range(6):
        out.append(f'<line x1="{left}" x2="{width - 20}" y1="{y(k / 5):.1f}" y2="{y(k / 5):.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{left - 8}" y="{y(k / 5) + 4:.1f}" text-anchor="end">{k / 5:.1f}</text>')
    for k in range(0, 10, 3):
        out.append(f'<text x="{x(k / 10):.1f}" y="{height - low + 20}" text-anchor="middle">{k / 10:.1f}</text>')
    out.append(f'<text x="{(left + width) / 2}" y="{height - 12}" text-anchor="middle">how far the tip has moved, over the rod\'s length</text>')
    out.append(f'<text transform="translate(18 {height / 2 - 20}) rotate(-90)" text-anchor="middle">load fraction</text>')
    for colour, sample in zip(colours, SAMPLES):
        points, turn = trace(sample)
        rest = points[0][0]
        places = [(x(np.linalg.norm(tip - rest) / length), y(load)) for tip, load in points]
        text = lambda some: " ".join(f"{a:.1f},{b:.1f}" for a, b in some)
        out.append(f'<polyline points="{text(places[:turn + 1])}" fill="none" stroke="{colour}" stroke-width="2"/>')
        out.append(f'<polyline points="{text(places[turn:])}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="5 4"/>')
        out.append(f'<circle cx="{places[turn][0]:.1f}" cy="{places[turn][1]:.1f}" r="4.5" fill="{colour}"/>')
        out.append(f'<text x="{places[turn][0]:.1f}" y="{places[turn][1] - 10:.1f}" text-anchor="middle" fill="{colour}">{points[turn][1]:.3f}</text>')
        print(sample, "turns at", round(points[turn][1], 4))
    out.append("</svg>")
    with open(sys.argv[1] if len(sys.argv) > 1 else "docs/turns.svg", "w") as file:
        file.write("\n".join(out) + "\n")


main()
