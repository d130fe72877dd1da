"""Films and pictures of a panel by cameras unlike the simulator's: see `run` beside it."""

import argparse
import json
import pathlib

from deceivers import draw_deceiver
from evaluate import evaluate_deceivers, evaluate_films, evaluate_pictures, reliability, report
from film import draw_film
from single import draw_single

# Printed for each film when it is drawn.
TOLD = ("distance", "pitch", "psf", "curve", "course", "storage", "clearness")
ROOT = pathlib.Path(__file__).resolve().parents[3]


def arguments():
    parser = argparse.ArgumentParser(prog="tests/tools/other-cameras/run", description=__doc__)
    parser.add_argument("--films", type=int, default=0, metavar="N", help="draw N films")
    parser.add_argument("--pictures", type=int, default=0, metavar="N", help="draw N single pictures of a panel on a board")
    parser.add_argument("--deceivers", type=int, default=0, metavar="N", help="draw N single pictures without a panel, of what looks like one")
    parser.add_argument("--seed", type=int, default=1, help="the first film's seed, and the pictures'; from 1000 on held out of tuning")
    parser.add_argument("--size", default="512x384", help="pixels of a film's frames; every sixth film is of full HD")
    parser.add_argument("--storage", help="how to keep all films: png, png16, jpg, h264, h265, rgb or bayer")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target/other-cameras/set", help="the folder")
    parser.add_argument("--photographs", type=pathlib.Path, default=ROOT / "target/photographs")
    parser.add_argument("--vocc", default=str(ROOT / "target/release/vocc"), help="the tool, which also says what the panel sends")
    parser.add_argument("--evaluate", action="store_true", help="receive all films of the folder and decode all pictures")
    parser.add_argument("--reliability", action="store_true", help="compare stated confidence with right bits, at wrong corners too")
    parser.add_argument("--at-least", metavar="FILMS,PICTURES", help="end with status 1 if fewer are delivered and found, or any is misplaced")
    parser.add_argument("--json", action="store_true", help="print the evaluation as JSON")
    given = parser.parse_args()
    if given.at_least and not given.evaluate:
        parser.error("--at-least asks for --evaluate")
    return given


def main():
    given = arguments()
    size = tuple(int(side) for side in given.size.split("x"))
    for seed in range(given.seed, given.seed + given.films):
        full = seed % 6 == 5
        folder = given.out / f"film-{seed:04d}"
        made = draw_film(seed, folder, given.photographs, given.vocc, (1920, 1080) if full else size, given.storage)
        print(folder, json.dumps({key: made[key] for key in TOLD}), flush=True)
    if given.pictures:
        pictures = given.out / "single"
        pictures.mkdir(parents=True, exist_ok=True)
        for index in range(given.pictures):
            draw_single(given.seed, index, pictures, given.photographs, (1920, 1080))
        print(f"{given.pictures} pictures in {pictures}", flush=True)
    if given.deceivers:
        pictures = given.out / "deceivers"
        pictures.mkdir(parents=True, exist_ok=True)
        for index in range(given.deceivers):
            draw_deceiver(given.seed, index, pictures, given.photographs)
        print(f"{given.deceivers} pictures without a panel in {pictures}", flush=True)
    if given.reliability:
        for line in reliability(given.vocc, given.out):
            print(json.dumps(line), flush=True)
    if given.evaluate:
        films = report(evaluate_films(given.vocc, given.out), "films", "delivered", given.json)
        pictures = report(evaluate_pictures(given.vocc, given.out / "single"), "pictures", "found", given.json)
        if given.deceivers:
            report(evaluate_deceivers(given.vocc, given.out / "deceivers"), "pictures without a panel", "found", given.json)
        if given.at_least:
            demand(given.at_least, films, pictures)


def demand(at_least, films, pictures):
    """Ends with status 1 where a set comes out worse."""
    least_films, least_pictures = (int(count) for count in at_least.split(","))
    misplaced = films["misplaced"] + pictures["misplaced"]
    if films["delivered"] < least_films or pictures["found"] < least_pictures or misplaced:
        raise SystemExit(f"fewer than {least_films} films or {least_pictures} pictures, or {misplaced} misplaced")


if __name__ == "__main__":
    main()
