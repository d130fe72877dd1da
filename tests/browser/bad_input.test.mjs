// Bad input leads to a sentence on the page, and the page continues to work.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import { film, open, textOf, workshop } from "./browser.mjs";

const SAYS = "#alert, #receive-state, #remarks, #pictures tbody";

/** Waits for a sentence in any of the places for error messages. */
async function says(page, pattern) {
  await page.waitForFunction(
    ([places, source]) => [...document.querySelectorAll(places)].some((place) => new RegExp(source).test(place.textContent)),
    [SAYS, pattern.source],
  ).catch(async () => {
    throw new Error(`the page says ${JSON.stringify(await page.locator(SAYS).allTextContents())}, and not ${pattern}`);
  });
}

/** Whether the simulator still draws. */
async function goesOn(page) {
  const { answer } = await page.evaluate(() => window.vocc.ask({ do: "open", scene: { name: "day" } }));
  assert.ok(answer.pitch_px > 1);
}

test("an address with nonsense", async (t) => {
  for (const [address, pattern] of [
    ["#mode=fly&scene=day", /mode must be one of/],
    ["#mode=explore&scene=noon", /noon/],
    ["#mode=explore&scene=day&pose.distance_m=-5", /0\.5 to 2000/],
    ["#mode=explore&scene=day&pose.wings=2", /wings/],
    ["#mode=explore&scene=day&seed=many", /seed must be a whole number/],
    ["#mode=explore&scene=day&%E0%A4%A", /%E0%A4%A/],
  ]) {
    const page = await open(t, { address });
    await says(page, pattern);
    await goesOn(page);
  }
});

test("a camera that sees no panel, over a picture that is no longer the scene's", async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=day" });
  await page.selectOption("#camera", "hm01b0");
  await says(page, /LEDs are 0\.\d+ px apart.* lower Distance or raise Interval/);
  const opacity = () => page.evaluate(() => Number(getComputedStyle(document.querySelector("#panel-explore .stage")).opacity));
  assert.ok((await opacity()) < 1);
  await page.fill("#set-distance_m", "100");
  await page.waitForFunction(() => document.querySelector("#alert").textContent === "");
  await page.waitForFunction(() => Number(getComputedStyle(document.querySelector("#panel-explore .stage")).opacity) === 1);
});

test("files that are none", async (t) => {
  const folder = workshop(t);
  const made = (name, bytes) => {
    const file = path.join(folder, name);
    writeFileSync(file, bytes);
    return file;
  };
  const whole = readFileSync(film(folder, 30, ["phone", "--frames", "3", "--set", "camera.width_px=320", "--set", "camera.height_px=240"]));
  const page = await open(t, { address: "#mode=receive" });
  for (const [file, pattern] of [
    [made("cut.y4m", whole.subarray(0, whole.length - 999)), /ends inside a frame|cut off/],
    [made("head.y4m", "YUV4MPEG2 W999999 H5\nFRAME\n"), /999999 × 5 pixels, and at most 8192 × 8192/],
    [made("mess.y4m", "nothing of the kind"), /does not begin as/],
    [made("empty.y4m", ""), /is empty|no frame|does not begin as/],
    [made("mess.png", "nothing of the kind"), /not a whole PNG, JPEG or PGM/],
    [made("huge.pgm", "P5 20000 9 255\n"), /1 × 1 to 8192 × 8192/],
    [made("mess.webm", "nothing of the kind"), /does not play|cannot be played|no film/],
    [made("grey.pgm", `P5 64 48 255\n${"a".repeat(64 * 48)}`), /nothing stands out/],
  ]) {
    await page.setInputFiles("#files", file);
    await says(page, pattern);
    await goesOn(page);
  }
});

test("a film without a panel says what would help", async (t) => {
  const folder = workshop(t);
  const file = path.join(folder, "grey.y4m");
  const frame = Buffer.concat([Buffer.from("FRAME\n"), Buffer.alloc(160 * 120, 90)]);
  writeFileSync(file, Buffer.concat([Buffer.from("YUV4MPEG2 W160 H120 F30:1 Cmono\n"), ...Array(20).fill(frame)]));
  const page = await open(t, { address: "#mode=receive" });
  await page.setInputFiles("#files", file);
  await textOf(page, "#remarks", /panel/);
});

test("a camera that is refused", async (t) => {
  const flags = ["--use-fake-device-for-media-stream", "--deny-permission-prompts"];
  const page = await open(t, { address: "#mode=receive", flags });
  await page.click("#webcam");
  await says(page, /refused|not allowed/);
});

test("a text that is too long", async (t) => {
  const page = await open(t, { address: "#mode=send&scene=day" });
  await page.fill("#message", "ü".repeat(600));
  await page.click("#send-start");
  await textOf(page, "#message-left", /too long/);
  assert.equal(await page.locator("#send-progress").evaluate((bar) => bar.value), 0);
  await goesOn(page);
});
