"""Values of thirty digits that the simulator's reference level is held to.

    pip install mpmath==1.3.0 gmpy2                # gmpy2 only makes it quicker
    python3 tests/numerics/light.py          # writes light.csv and edge.csv beside this file, in some ten minutes
    python3 tests/numerics/light.py --check  # only compares with what stands there

light.csv: the light at a pixel, the unit square about (x, y), of the ellipse (xx·cos φ + yx·sin φ, xy·cos φ + yy·sin φ) of
luminance 1 under a Gaussian blur of standard deviation sigma. It is computed by the first of these ways; every shape at
every sigma is computed by the second too, on the edge and in the far tail, and some by the third. Nothing is written unless they agree
to 20 digits:

 1. slices along y: ∫ β(x − u)·(ς(y − v₋(u)) − ς(y − v₊(u))) du over the ellipse's width, by Gauss-Legendre quadrature;
 2. Green's theorem along x: ∮ Q(x − u, y − v) dv with Q the integral of the blurred pixel along x, by tanh-sinh quadrature;
 3. polar coordinates: the Gaussian over the pixel, itself by quadrature and without the error function, summed over the disc.

edge.csv: the bell β(s), the step ς(s) and the difference ς(b) − ς(a) of two steps.
"""

import csv
import sys
from pathlib import Path

from mpmath import acos, atan2, cos, erfc, exp, fabs, mp, mpf, nstr, pi, quad, sin, sqrt

mp.dps = 36
HERE = Path(__file__).parent
DIGITS = 30
AGREEMENT = mpf(10) ** -20
# Below this nothing is compared relatively.
NOTHING = mpf(10) ** -60


def gauss_above(z):
    """The part of a standard normal distribution above z."""
    return erfc(z / sqrt(mpf(2))) / 2


def bell(s, sigma):
    """β: ∫ of the Gaussian over the pixel's width at distance s."""
    s = fabs(s)
    if sigma == 0:
        return mpf(1) if s < mpf("0.5") else mpf(0)
    return gauss_above((s - mpf("0.5")) / sigma) - gauss_above((s + mpf("0.5")) / sigma)


def ramp(s, sigma):
    """∫ of the Gaussian's distribution function from −∞ to s."""
    if sigma == 0:
        return max(s, mpf(0))
    z = s / sigma
    return s * gauss_above(-z) + sigma * exp(-z * z / 2) / sqrt(2 * pi)


def step(s, sigma):
    """ς: the integral of β from −∞ to s."""
    return ramp(s + mpf("0.5"), sigma) - ramp(s - mpf("0.5"), sigma)


def integral(function, start, end, method):
    """∫ from start to end, to a relative error: mpmath's own is absolute, which says nothing in a far tail."""
    scale = max(fabs(function(start + (end - start) * k / 8)) for k in range(9))
    if scale == 0:
        return mpf(0)
    return scale * quad(lambda t: function(t) / scale, [start, end], method=method)


class Ellipse:
    def __init__(self, xx, xy, yx, yy):
        # The doubles nearest to the decimals, as Rust reads them too.
        self.xx, self.xy, self.yx, self.yy = (mpf(float(c)) for c in (xx, xy, yx, yy))

    def point(self, phi):
        return self.xx * cos(phi) + self.yx * sin(phi), self.xy * cos(phi) + self.yy * sin(phi)


def meetings(along, value):
    """Angles at which a·cos φ + b·sin φ = value."""
    a, b = along
    length = sqrt(a * a + b * b)
    if fabs(value) >= length:
        return []
    middle, half = atan2(b, a), acos(value / length)
    return [middle - half, middle + half]


def cuts(at, sigma):
    """Places across which bell or step change: the pixel's sides, and some σ about them."""
    offsets = [0] if sigma == 0 else [0, 2, 4, 6, 9, 12, 15, 19, 23]
    return [at + side + sign * k * sigma for side in (mpf("-0.5"), mpf("0.5")) for sign in (-1, 1) for k in offsets]


def angles(ellipse, x, y, sigma):
    """A whole turn, cut where the boundary crosses something."""
    found = {mpf(k) * pi / 4 for k in range(9)}
    for along, at in (((ellipse.xx, ellipse.yx), x), ((ellipse.xy, ellipse.yy), y)):
        for cut in cuts(at, sigma):
            found.update(angle % (2 * pi) for angle in meetings(along, cut))
    return sorted(found)


def is_far(values, at, sigma):
    reach = mpf("0.5") + 23 * sigma
    return all(v < at - reach for v in values) or all(v > at + reach for v in values)


def by_slices(ellipse, x, y, sigma):
    """Way 1. The slices at u = A·cos φ from upper to lower boundary."""
    a = sqrt(ellipse.xx**2 + ellipse.yx**2)
    tilt = (ellipse.xx * ellipse.xy + ellipse.yx * ellipse.yy) / a
    half = fabs(ellipse.xx * ellipse.yy - ellipse.xy * ellipse.yx) / a
    ends = {mpf(0), pi / 2, pi}
    for cut in cuts(x, sigma):
        if fabs(cut) < a:
            ends.add(acos(cut / a))
    for cut in cuts(y, sigma):
        for angle in meetings((tilt, half), cut) + meetings((tilt, -half), cut):
            if 0 < angle % (2 * pi) < pi:
                ends.add(angle % (2 * pi))
    ends = sorted(ends)

    def slice_at(phi):
        u, middle, reach = a * cos(phi), tilt * cos(phi), half * sin(phi)
        near, far = y - middle - reach, y - middle + reach
        if near > 0:
            near, far = -far, -near
        return bell(x - u, sigma) * (step(far, sigma) - step(near, sigma)) * a * sin(phi)

    total = mpf(0)
    for start, end in zip(ends, ends[1:]):
        if not is_far([a * cos(start), a * cos(end)], x, sigma):
            total += integral(slice_at, start, end, "gauss-legendre")
    return total


def by_green(ellipse, x, y, sigma):
    """Way 2. The boundary once round; the pixel's integral along x taken from its dark side."""
    turns = -1 if x < 0 else 1
    orientation = 1 if ellipse.xx * ellipse.yy > ellipse.xy * ellipse.yx else -1

    def around(phi):
        u, v = ellipse.point(phi)
        rise = -ellipse.xy * sin(phi) + ellipse.yy * cos(phi)
        return step(turns * (u - x), sigma) * bell(y - v, sigma) * rise

    ends = angles(ellipse, x, y, sigma)
    total = mpf(0)
    for start, end in zip(ends, ends[1:]):
        middle = (start + end) / 2
        u = [turns * (ellipse.point(phi)[0] - x) for phi in (start, middle, end)]
        v = [ellipse.point(phi)[1] for phi in (start, middle, end)]
        if max(u) > -mpf("0.5") - 23 * sigma and not is_far(v, y, sigma):
            total += integral(around, start, end, "tanh-sinh")
    return orientation * turns * total


def by_points(ellipse, x, y, sigma):
    """Way 3. Polar coordinates over the disc, the Gaussian integrated over the pixel by quadrature too."""
    half = mpf("0.5")

    def density(s):
        return exp(-(s * s) / (2 * sigma * sigma)) / (sigma * sqrt(2 * pi))

    def along(distance):
        return quad(density, [distance - half, distance + half], method="gauss-legendre", maxdegree=4)

    def ring(radius):
        # The trapezoidal rule round a circle converges faster than any power of its count.
        count = 96
        places = [ellipse.point(2 * pi * k / count) for k in range(count)]
        return 2 * pi / count * radius * sum(along(x - radius * u) * along(y - radius * v) for u, v in places)

    jacobian = fabs(ellipse.xx * ellipse.yy - ellipse.xy * ellipse.yx)
    return jacobian * quad(ring, [0, 1], method="gauss-legendre", maxdegree=5)


def agree(a, b):
    return fabs(a - b) <= AGREEMENT * max(fabs(a), fabs(b)) or max(fabs(a), fabs(b)) < NOTHING


SIGMAS = ["0", "0.001", "0.05", "0.3", "1.5", "10", "50"]
# Circles of diameters from a thousandth to a thousand pixels, and tilted ellipses.
SHAPES = [
    *((radius, "0", "0", radius) for radius in ("0.0005", "0.025", "0.25", "1.0909", "1.8", "20", "500")),
    ("1.7", "0.3", "-0.2", "1.1"),
    ("0.9", "0.4", "0.35", "0.6"),
    ("0.06", "0.3", "-0.4", "0.02"),
    ("400", "-150", "90", "300"),
]

# Where blur and shape are of one size: there the third way needs few points.
BLURS_BETWEEN = ["0.3", "1.5", "10"]
SHAPES_BETWEEN = [SHAPES[3], SHAPES[7]]


def places(ellipse, sigma):
    """Pixels within, on the edge, and in the tail, farther and farther out."""
    yield mpf("0.13"), mpf("-0.21")
    for phi, outwards in (("0.7", ["0", "-0.6", "0.4", "3s", "10.5s"]), ("3.3", ["0.45", "6s"]), ("4.7", ["-0.3"])):
        u, v = ellipse.point(mpf(phi))
        # The normal of the boundary points along (dv, −du), turned outwards.
        rise = -ellipse.xy * sin(mpf(phi)) + ellipse.yy * cos(mpf(phi))
        run = -ellipse.xx * sin(mpf(phi)) + ellipse.yx * cos(mpf(phi))
        length = sqrt(rise**2 + run**2)
        normal = (rise / length, -run / length)
        if normal[0] * u + normal[1] * v < 0:
            normal = (-normal[0], -normal[1])
        for way in outwards:
            if way.endswith("s"):
                if sigma == 0:
                    continue
                distance = mpf("0.5") + mpf(way[:-1]) * sigma
            else:
                distance = mpf(way)
            yield u + normal[0] * distance, v + normal[1] * distance


def exactly(number, digits=12):
    """The number rounded to a double, as Rust and this script then both read it."""
    return repr(float(nstr(number, digits)))


def light_rows():
    for shape in SHAPES:
        ellipse = Ellipse(*shape)
        for sigma_text in SIGMAS:
            sigma = mpf(float(sigma_text))
            for count, (x, y) in enumerate(places(ellipse, sigma)):
                x_text, y_text = exactly(x), exactly(y)
                x, y = mpf(float(x_text)), mpf(float(y_text))
                slices = by_slices(ellipse, x, y, sigma)
                others = []
                if count % 4 == 1:
                    others.append(by_green)
                if count == 1 and sigma_text in BLURS_BETWEEN and shape in SHAPES_BETWEEN:
                    others.append(by_points)
                for other in others:
                    value = other(ellipse, x, y, sigma)
                    if not agree(slices, value):
                        case = f"shape {shape}, sigma {sigma_text}, at ({x_text}, {y_text})"
                        raise SystemExit(f"{case}: {nstr(slices, 25)} by slices, {nstr(value, 25)} {other.__name__}")
                yield [sigma_text, *(repr(float(c)) for c in shape), x_text, y_text, nstr(slices, DIGITS)]


def edge_rows():
    for sigma_text in SIGMAS[1:]:
        sigma = mpf(float(sigma_text))
        for z in ("0", "0.3", "1.7", "5", "8", "11.3"):
            for sign in (-1, 1):
                # Outside the pixel by z·σ, and a step that is a fiftieth, one and ten σ long.
                s = sign * (mpf("0.5") + mpf(z) * sigma)
                start_text = exactly(s)
                start = mpf(float(start_text))
                for length in ("0.02", "1", "10"):
                    end_text = exactly(start + mpf(length) * sigma)
                    end = mpf(float(end_text))
                    ends = sorted({start, end} | {c for c in cuts(mpf(0), sigma) if start < c < end})
                    pieces = zip(ends, ends[1:])
                    between = sum(integral(lambda t: bell(t, sigma), *piece, "gauss-legendre") for piece in pieces)
                    low, high = (start, end) if start <= 0 else (-end, -start)
                    # Here and only here the two steps are almost the same.
                    with mp.workdps(80):
                        difference = step(high, sigma) - step(low, sigma)
                    if not agree(between, difference):
                        raise SystemExit(f"step between {start_text} and {end_text} at sigma {sigma_text}")
                    yield [sigma_text, start_text, end_text, *(nstr(v, DIGITS) for v in (bell(start, sigma), step(start, sigma), between))]


def csv_text(header, rows):
    lines = [header]
    for row in rows:
        lines.append(",".join(row))
        if len(lines) % 50 == 0:
            print(len(lines), file=sys.stderr)
    return "\n".join(lines) + "\n"


def main():
    tables = {
        "edge.csv": ("sigma,start,end,bell,step,between", edge_rows),
        "light.csv": ("sigma,xx,xy,yx,yy,x,y,light", light_rows),
    }
    for name, (header, rows) in tables.items():
        text, path = csv_text(header, rows()), HERE / name
        if "--check" in sys.argv:
            if path.read_text() != text:
                raise SystemExit(f"{name} differs from what is computed")
        else:
            path.write_text(text)


if __name__ == "__main__":
    main()
