// The page draws and reads the same as the program, to the bit.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import { ask, open, vocc, workshop } from "./browser.mjs";

/** A preset, its overrides, and the level of drawing. */
const SCENES = [
  ["paper", [], "fast"],
  ["day", ["pose.distance_m=30", "pose.yaw_deg=12"], "fine"],
  ["night", ["panel.interval=0.5", "camera.psf=disc"], "fast"],
  ["phone", ["pose.distance_m=8"], "fine"],
  ["fog", [], "reference"],
];

/** In the page: its own picture of a frame, that of a file, and the reading of the file. */
async function both([frame, file]) {
  const ours = await window.vocc.ask({ do: "picture", frame });
  const theirs = await window.vocc.ask({ do: "decode" }, Uint8Array.from(atob(file), (letter) => letter.charCodeAt(0)));
  const isSame = ours.answer.width === theirs.answer.width && ours.bytes.length === theirs.bytes.length;
  const differing = isSame ? ours.bytes.filter((grey, at) => grey !== theirs.bytes[at]).length : Infinity;
  return { differing, sent: ours.answer.sent, read: theirs.answer };
}

for (const [name, set, level] of SCENES) {
  test(`pictures of ${name}, drawn ${level}, are those of vocc render`, async (t) => {
    const folder = workshop(t);
    const page = await open(t);
    const seed = 7;
    await ask(page, { do: "open", scene: { name, set }, level, seed });
    let found = 0;
    for (const frame of [0, 5]) {
      const file = path.join(folder, "frame.png");
      const settings = set.flatMap((key) => ["--set", key]);
      const words = [...settings, "--level", level, "--seed", seed, "--frame", frame, "--out", file, "--json"];
      const said = JSON.parse(vocc("render", name, ...words.map(String)));
      const seen = await page.evaluate(both, [frame, readFileSync(file).toString("base64")]);
      assert.equal(seen.differing, 0, "no pixel differs");
      assert.equal(seen.sent, said.bits);
      const decoded = JSON.parse(vocc("decode", file, "--json"));
      assert.equal(seen.read.found, decoded.found);
      assert.equal(seen.read.bits, decoded.bits);
      // Both are the same 32-bit number.
      assert.equal(Math.fround(seen.read.confidence), Math.fround(decoded.confidence));
      found += Number(decoded.found);
    }
    assert.ok(found > 0, "one of the frames shows the panel");
  });
}

test("bit errors are those of vocc evaluate", async (t) => {
  const page = await open(t);
  const set = ["pose.distance_m=70", "panel.interval=0.5", "ambient.illuminance_lx=1000", "effects.noise=on"];
  const words = set.flatMap((key) => ["--set", key]);
  for (const detector of ["kmeans", "best"]) {
    const theirs = JSON.parse(vocc("evaluate", "paper", ...words, "--frames", "300", "--detector", detector, "--json"));
    await ask(page, { do: "count", scene: { name: "paper", set }, detector });
    for (const frames of [100, 200]) {
      var { answer: ours } = await ask(page, { do: "count_on", frames });
    }
    assert.equal(ours.frames, theirs.frames);
    assert.equal(ours.bit_errors, theirs.bit_errors);
    if (detector === "kmeans") assert.ok(ours.bit_errors > 0, "there are some to compare");
    assert.ok(Math.abs(ours.b2w / theirs.b2w - 1) < 1e-9);
  }
});

test("the best L2A is that of vocc optimize", async (t) => {
  const page = await open(t);
  const frames = 512;
  const set = ["pose.distance_m=60", "panel.interval=0.5", "ambient.illuminance_lx=1000", "effects.noise=on"];
  const table = path.join(workshop(t), "table.toml");
  const words = ["--illuminances", "1000", "--intervals", "0.5", "--distances", "60", "--frames", String(frames), "--tolerance", "0"];
  const settings = set.flatMap((key) => ["--set", key]);
  const theirs = JSON.parse(vocc("optimize", "paper", ...settings, ...words, "-o", table, "--json").split("\n")[0]);
  const { answer } = await ask(page, { do: "optimum", scene: { name: "paper", set }, measure: "b2w", detector: "kmeans", frames });
  assert.ok(Math.abs(answer.l2a - theirs.l2a) < 1e-3, `${answer.l2a} and ${theirs.l2a}`);
});

test("the plan is that of vocc plan", async (t) => {
  const page = await open(t);
  const { answer } = await ask(page, { do: "open", scene: { name: "night", set: [] } });
  const lines = vocc("plan", "night", "--json").trim().split("\n").map((line) => JSON.parse(line));
  assert.equal(answer.plan.length, lines.length);
  for (const [at, theirs] of lines.entries()) {
    for (const key of ["effect", "bound_grey", "included", "why"]) assert.deepEqual(answer.plan[at][key], theirs[key]);
  }
});
