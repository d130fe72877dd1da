// Compares the page's speed with the program's, only on request (tests/tools/page --times).

import test from "node:test";
import { execFileSync } from "node:child_process";
import { statSync, readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { ask, open } from "./browser.mjs";

const { VOCC, VOCC_PAGE, VOCC_TIMES } = process.env;
const TURNS = 5;

const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

/** Frames a second that are shown while a slider moves with each picture of the screen. */
async function whileMoving(page) {
  return page.evaluate(() => new Promise((done) => {
    const slider = document.querySelector("#sliders input[type=range]");
    const [low, high] = [Number(slider.min), Number(slider.max)];
    const begun = performance.now();
    const before = window.vocc.stats.frames;
    const move = (now) => {
      const seconds = (now - begun) / 1000;
      if (seconds > 3) {
        done((window.vocc.stats.frames - before) / seconds);
        return;
      }
      slider.value = low + (high - low) * (0.6 + 0.2 * Math.sin(3 * seconds));
      slider.dispatchEvent(new Event("input", { bubbles: true }));
      requestAnimationFrame(move);
    };
    requestAnimationFrame(move);
  }));
}

/** Milliseconds for this many frames with the program, on one thread. */
function native(frames, detector) {
  const words = ["evaluate", "day", "--frames", frames, "--detector", detector, "--threads", 1, "--json"].map(String);
  return 1000 * JSON.parse(execFileSync(VOCC, words, { encoding: "utf8" })).seconds;
}

/** Milliseconds for the same frames with the page. */
async function browser(page, frames, detector) {
  await ask(page, { do: "count", scene: { name: "day", set: [] }, detector });
  return (await ask(page, { do: "count_on", frames })).answer.ms;
}

test("times", { skip: !VOCC_TIMES }, async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=day" });
  await page.waitForFunction(() => window.vocc.stats.frames > 100);
  const [firstMs, fps] = await page.evaluate(() => [window.vocc.firstPictureMs, window.vocc.stats.fps]);
  console.log(`page: ${statSync(VOCC_PAGE).size} bytes, ${gzipSync(readFileSync(VOCC_PAGE), { level: 9 }).length} gzipped`);
  console.log(`first picture after ${firstMs.toFixed(0)} ms; ${fps.toFixed(0)} frames a second`);
  console.log(`while a slider moves: ${(await whileMoving(page)).toFixed(0)} frames a second`);
  await page.click("#pause");
  for (const [detector, frames] of [["kmeans", 10_000], ["best", 1000]]) {
    const pairs = [];
    for (let turn = 0; turn < TURNS; turn += 1) {
      pairs.push([native(frames, detector), await browser(page, frames, detector)]);
    }
    const [own, here] = [0, 1].map((at) => median(pairs.map((pair) => pair[at])));
    const ratio = median(pairs.map(([own, here]) => here / own));
    const each = (ms) => `${((1000 * ms) / frames).toFixed(1)} µs`;
    console.log(`${detector}: a frame takes ${each(here)} here, ${each(own)} by the program: ${ratio.toFixed(2)} times as long`);
  }
});
