"""The tool's results on a set: delivered messages, raw bit errors, panels in a wrong place. Only the two rates are configured."""

import json
import subprocess

import numpy as np

from plane import homography, mapped

# A frame whose exposure contains more than this share of the next symbol does not show its own symbol.
MIXED = 0.02


def truths(folder, name):
    """Path and truth of each member of a set, in order."""
    for path in sorted(folder.glob(name)):
        yield path, json.loads(path.read_text())


def receive(vocc, film, args):
    """The output of `vocc receive` for a film: lines of JSON, and its last error."""
    command = [vocc, "receive", "--bits", "--json", "--fps", str(args["fps"]), "--symbol-rate", str(args["symbol_rate"])]
    command += args.get("receive_args", [])
    if (film / "film.mp4").exists():
        decode = ["ffmpeg", "-loglevel", "error", "-i", str(film / "film.mp4"), "-f", "yuv4mpegpipe", "-"]
        with subprocess.Popen(decode, stdout=subprocess.PIPE) as stream:
            ended = subprocess.run([*command, "-"], stdin=stream.stdout, capture_output=True, text=True)
    else:
        ended = subprocess.run([*command, str(film)], capture_output=True, text=True)
    lines = [json.loads(line) for line in ended.stdout.splitlines() if line.startswith("{")]
    complaints = ended.stderr.strip().splitlines()
    return lines, complaints[-1] if complaints else ""


def evaluate_film(vocc, film, truth):
    """One film: delivered or not, frames read, wrong places, bit errors of read frames; broken LEDs and mixed frames separately."""
    lines, complaint = receive(vocc, film, truth["args"])
    numbers = sorted(int(path.stem) for path in film.iterdir() if path.stem.isdigit())
    kept = numbers or [frame["frame"] for frame in truth["frames"] if not frame["lost"]]
    frames = {frame["frame"]: frame for frame in truth["frames"]}
    working = sum(1 << led for led in range(64) if led not in truth["dead_leds"])
    result = {"set": film.name, "delivered": False, "frames": len(kept), "read": 0, "misplaced": 0, "errors": 0, "bits": 0, "why": ""}
    for line in lines:
        result["delivered"] |= "Lane closed ahead" in str(line.get("message", ""))
        if "bits" not in line or "frame" not in line or line["frame"] >= len(kept):
            continue
        frame = frames[kept[line["frame"]]]
        result["read"] += 1
        result.setdefault("first", line["frame"])
        apart = np.hypot(*(np.array(frame["centre_px"]) - line["centre_px"]))
        result["misplaced"] += int(apart > 0.5 * frame["pitch_px"])
        if frame["mixed_with_next"] <= MIXED:
            result["errors"] += ((int(frame["bits"], 16) ^ int(line["bits"], 16)) & working).bit_count()
            result["bits"] += working.bit_count()
    if not result["delivered"]:
        result["why"] = complaint
    return result


def evaluate_films(vocc, folder):
    """All films of a folder, one after the other."""
    for path, truth in truths(folder, "*/truth.json"):
        yield evaluate_film(vocc, path.parent, truth)


def pictures(folder):
    """Each single picture of a folder, and its truth."""
    for path, truth in truths(folder, "*.json"):
        yield next(path.with_suffix(end) for end in (".png", ".jpg") if path.with_suffix(end).exists()), truth


def decode(vocc, picture, corners=None):
    """The output of `vocc decode` for a picture, at given corners if there are any."""
    command = [vocc, "decode", "--json", str(picture)]
    if corners is not None:
        command.append("--corners=" + ",".join(f"{c:.3f}" for c in np.ravel(corners)))
    ended = subprocess.run(command, capture_output=True, text=True)
    return json.loads(ended.stdout.splitlines()[0]) if ended.stdout else {"found": False, "why": ended.stderr.strip()}


def wrong_bits(truth, seen):
    """The number of wrong bits of working LEDs, and the number of all."""
    bits = int("".join(truth["bits"])[::-1], 2)
    working = sum(1 << led for led in range(64) if led not in truth["dead_leds"])
    return ((bits ^ int(seen["bits"], 16)) & working).bit_count(), working.bit_count()


def evaluate_pictures(vocc, folder):
    """All single pictures of a folder."""
    for picture, truth in pictures(folder):
        seen = decode(vocc, picture)
        result = {"picture": picture.name, "found": bool(seen["found"]), "misplaced": 0, "errors": 0, "bits": 0}
        result["why"] = str(seen["why"] or "")
        if result["found"]:
            corners = np.array(truth["led_corner_centres_px"])
            pitch = np.hypot(*(corners[1] - corners[0])) / 7
            result["misplaced"] = int(np.hypot(*(corners.mean(axis=0) - seen["centre_px"])) > 0.4 * pitch)
            result["errors"], result["bits"] = wrong_bits(truth, seen)
        yield result


# Corners that are not the panel's, in columns and rows from its first LED.
SQUARE = np.array([[0, 0], [7, 0], [7, 7], [0, 7]], dtype=float)
DISTURBED = {
    "a column beside": SQUARE + [1, 0],
    "a row beside": SQUARE - [0, 1],
    "half a line beside": SQUARE + [0.5, 0.5],
    "a corner off": SQUARE + [[1, 0], [0, 0], [0, 0], [0, 0]],
    "a column wider": SQUARE + [[0, 0], [1, 0], [1, 0], [0, 0]],
    "inner LEDs": 1 + SQUARE * 5 / 7,
}
# Lowest confidence of each bin.
BINS = (0.99, 0.9, 0.7, 0.0)
# A panel is right if at least this share of its working LEDs is.
RIGHT = 0.9


def reliability(vocc, folder):
    """Stated and true share of right bits in each bin of confidence, for found panels and for given corners."""
    stated = {"found": [], "true corners": [], "disturbed corners": [], "without a panel": []}
    disturbed = list(DISTURBED.values())
    for number, (picture, truth) in enumerate(pictures(folder / "single")):
        corners = np.array(truth["led_corner_centres_px"])
        given = {
            "found": None,
            "true corners": corners,
            "disturbed corners": mapped(homography(SQUARE, corners), disturbed[number % len(disturbed)]),
        }
        for kind, corners in given.items():
            seen = decode(vocc, picture, corners)
            if seen["found"]:
                wrong, bits = wrong_bits(truth, seen)
                stated[kind].append((seen["confidence"], 1 - wrong / bits))
    for picture in sorted((folder / "deceivers").glob("*")):
        seen = decode(vocc, picture)
        if seen["found"]:
            stated["without a panel"].append((seen["confidence"], 0.0))
    for kind, panels in stated.items():
        high = 1.1
        for low in BINS:
            shares = [(confidence, right) for confidence, right in panels if low <= confidence < high]
            if shares:
                wrong = sum(right < RIGHT for _, right in shares)
                means = np.mean(shares, axis=0).tolist()
                yield {"kind": kind, "from": low, "panels": len(shares), "stated": means[0], "right": means[1], "wrong_panels": wrong}
            high = low


def summary(results, what, good):
    """The sums over a set."""
    results = list(results)
    total = {key: sum(result[key] for result in results) for key in (good, "misplaced", "errors", "bits")}
    return {"summary": what, "of": len(results), **total}


def evaluate_deceivers(vocc, folder):
    """All pictures without a panel of a folder: the number of false panels."""
    for picture in sorted(folder.iterdir()):
        seen = decode(vocc, picture)
        yield {"picture": picture.name, "found": bool(seen["found"]), "misplaced": 0, "errors": 0, "bits": 0, "why": str(seen["why"] or "")}


def report(results, what, good, as_json):
    """Prints each result as it arrives, then prints and returns the sums."""
    kept = []
    for result in results:
        kept.append(result)
        print(json.dumps(result) if as_json else words(result), flush=True)
    total = summary(kept, what, good)
    if as_json:
        print(json.dumps(total))
    elif kept:
        share = total["errors"] / max(1, total["bits"])
        arrived = f"{total[good]} of {total['of']} {good}, {total['misplaced']} misplaced"
        print(f"{what}: {arrived}, {total['errors']} of {total['bits']} bits wrong ({share:.3%})")
    return total


def words(result):
    """A result on a line."""
    errors = f"wrong {result['errors']}/{result['bits']}  {result['why'][:150]}"
    if "set" in result:
        state = "delivered" if result["delivered"] else "NOT"
        read = f"read {result['read']}/{result['frames']}, first {result.get('first', '-')}"
        return f"{result['set']:12} {state:9} {read}, misplaced {result['misplaced']}, {errors}"
    state = "MISPLACED" if result["misplaced"] else "found" if result["found"] else "NOT"
    return f"{result['picture']:26} {state:9} {errors}"
