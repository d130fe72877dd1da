"""Films of a camera whose lines are exposed one after another, and what `vocc receive` makes of them: see `run` beside it."""

import argparse
import itertools
import json
import pathlib
import shutil
import subprocess

import numpy as np
from film import frames, symbols, write_pgm

ROOT = pathlib.Path(__file__).resolve().parents[3]
MESSAGE = "Braking hard: queue behind the bend, 200 m ahead"


def numbers(text):
    return [float(word) for word in text.split(",")]


def arguments():
    parser = argparse.ArgumentParser(prog="tests/tools/line-by-line/run", description=__doc__)
    parser.add_argument("--exposures", type=numbers, default=[0.1, 1, 5], help="in ms")
    parser.add_argument("--pitches", type=numbers, default=[4, 14], help="of the LEDs, in px")
    parser.add_argument("--line-us", type=numbers, default=[18.9], help="from one line to the next, in µs; negative: read from below")
    parser.add_argument("--rates", type=numbers, default=[27], help="symbols a second")
    parser.add_argument("--roll", type=float, default=0, help="degrees")
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--size", default="320x320", help="pixels of a frame")
    parser.add_argument("--seeds", type=int, default=5, help="films of each kind, each of another phase")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--vocc", default=str(ROOT / "target/release/vocc"))
    parser.add_argument("--camera", help="a camera's file for vocc receive")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target/line-by-line/films")
    parser.add_argument("--keep", action="store_true", help="leave the films in their folders, each with its truth.json")
    return parser.parse_args()


def draw(folder, args, vocc, seed):
    """Draws a film into a folder."""
    random = np.random.default_rng(seed)
    args = {**args, "phase": (0.37 * seed) % 1, "sigma_px": 1.0, "full_well_e": 5000}
    count = int(args["frames"] / args["fps"] * args["symbol_rate"]) + 4
    shown = symbols(vocc, MESSAGE, count)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for number, pixels in enumerate(frames(args, shown, random)):
        write_pgm(folder / f"{number:05d}.pgm", pixels)
    (folder / "truth.json").write_text(json.dumps({"args": args, "symbols": [f"{bits:016x}" for bits in shown]}))


def receive(folder, args, vocc, camera):
    """The frame in which the message was whole, or none; and what was learnt of the lines, in exposures."""
    command = [vocc, "receive", "--json", "--fps", str(args["fps"]), "--symbol-rate", str(args["symbol_rate"]), str(folder)]
    command += ["--camera", camera] if camera else []
    ended = subprocess.run(command, capture_output=True, text=True)
    lines = [json.loads(line) for line in ended.stdout.splitlines() if line.startswith("{")]
    whole = [line["last_frame"] for line in lines if line.get("message") == MESSAGE]
    told = [line for line in lines if "message" in line] or lines
    delays = [line["camera"].get("line_delay_exposures") for line in told if line.get("camera")]
    return (whole[0] if whole else None), (delays[-1] if delays else None)


def main():
    given = arguments()
    width, height = (int(side) for side in given.size.split("x"))
    print("| pitch (px) | line (µs) | exposure (ms) | symbols/s | delivered | mean frames | line over exposure | as learnt |")
    print("|---|---|---|---|---|---|---|---|")
    for pitch, line_us, exposure, rate in itertools.product(given.pitches, given.line_us, given.exposures, given.rates):
        args = {
            "size": (width, height), "pitch_px": pitch, "roll_deg": given.roll, "fps": given.fps, "frames": given.frames,
            "line_s": 1e-6 * line_us, "exposure_s": 1e-3 * exposure, "symbol_rate": rate,
        }
        ends, delays = [], []
        for seed in range(given.first_seed, given.first_seed + given.seeds):
            folder = given.out / f"{pitch:g}px-{line_us:g}us-{exposure:g}ms-{rate:g}hz-{seed}"
            draw(folder, args, given.vocc, seed)
            end, delay = receive(folder, args, given.vocc, given.camera)
            ends += [end] if end is not None else []
            delays += [delay] if delay is not None else []
            if not given.keep:
                shutil.rmtree(folder)
        mean = f"{np.mean(ends) + 1:.0f}" if ends else "–"
        learnt = f"{np.median(delays):.4f}" if delays else "–"
        print(
            f"| {pitch:g} | {line_us:g} | {exposure:g} | {rate:g} | {len(ends)} of {given.seeds} | {mean} "
            f"| {line_us / exposure / 1e3:.4f} | {learnt} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
