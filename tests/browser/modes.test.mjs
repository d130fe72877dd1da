// Each mode works as described.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import { gzipSync } from "node:zlib";
import { ask, film, keyFile, open, shots, textOf, vocc, workshop } from "./browser.mjs";

/** A phone's film of a text: 30 frames a second, 27 symbols. */
const TEXT = "Ice on the bridge";
const PHONE = ["phone", "--set", "pose.distance_m=6", "--set", "camera.width_px=640", "--set", "camera.height_px=480"];
const FILM = [...PHONE, "--message", TEXT, "--frames", "90"];

test("explore: frames follow one another, and a slider changes the scene", async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=day&pose.distance_m=50" });
  assert.ok((await page.evaluate(() => window.vocc.firstPictureMs)) > 0);
  await page.waitForFunction(() => window.vocc.stats.frames > 10);
  const far = await page.locator("#numbers").textContent();
  await page.evaluate(() => (location.hash = "#mode=explore&scene=day&pose.distance_m=20"));
  await page.waitForFunction((far) => document.querySelector("#numbers").textContent !== far, far);
  assert.ok((await page.locator("#plan tbody tr").count()) > 15);
});

test("explore: a slider is moved by keys, and each step is in the address", async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=day" });
  const apart = await page.locator("#numbers").textContent();
  await page.focus("#set-distance_m");
  for (let step = 0; step < 30; step += 1) await page.keyboard.press("ArrowLeft");
  await page.waitForFunction((apart) => document.querySelector("#numbers").textContent !== apart, apart);
  await page.waitForFunction(() => /pose\.distance_m=4\d/.test(location.hash));
});

test("explore: each camera films the scene, with as many symbols a frame", async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=night" });
  await page.selectOption("#camera", "phone");
  await textOf(page, "#numbers", /30 frames\/s.*27 a second/);
  await page.waitForFunction(() => location.hash.includes("scene=night") && location.hash.includes("camera.focal_length_mm=3.04"));
  assert.match(await page.inputValue("#command"), /render night .*--set camera\.frame_rate_hz=30 /);
  // Another page with this address has the same camera.
  const another = await open(t, { address: new URL(page.url()).hash });
  await another.waitForFunction(() => document.querySelector("#camera").value === "phone");
  assert.equal(await another.textContent("#other-keys"), "");
  await page.selectOption("#camera", "paper");
  await page.waitForFunction(() => !location.hash.includes("camera."));
});

test("all of it is one file of less than 1 MB, packed", () => {
  assert.ok(gzipSync(readFileSync(process.env.VOCC_PAGE), { level: 9 }).length < 1_000_000);
});

test("how good: both detectors are counted, and the curve has its best", async (t) => {
  const page = await open(t, { address: "#mode=good&scene=night&panel.interval=0.5" });
  await textOf(page, "#ber-kmeans", /\d/);
  await textOf(page, "#ber-best", /\d/);
  await textOf(page, "#curve-text", /[Bb]est of the curve/);
  assert.ok((await page.locator("#curve-table tbody tr").count()) > 5);
});

test("by the keyboard alone one goes from mode to mode", async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=day" });
  await page.focus("#tab-explore");
  for (const mode of ["good", "accuracy", "send", "receive", "explore"]) {
    await page.keyboard.press("ArrowRight");
    assert.ok(await page.locator(`#panel-${mode}`).isVisible());
    assert.equal(await page.evaluate(() => document.activeElement.id), `tab-${mode}`);
  }
});

test("whoever does not see the page is told what each thing is", async (t) => {
  for (const mode of ["explore", "good", "accuracy", "send", "receive"]) {
    const page = await open(t, { address: `#mode=${mode}&scene=day` });
    const unnamed = await page.evaluate(() => [...document.querySelectorAll("input, select, textarea, button, [role=img], [role=region]")]
      .filter((element) => element.checkVisibility())
      .filter((element) => !element.ariaLabel && !element.labels?.length && !(element.tagName === "BUTTON" && element.textContent))
      .map((element) => element.outerHTML));
    assert.deepEqual(unnamed, [], mode);
  }
});

test("accuracy: four ways of drawing, each with its error and time", async (t) => {
  const page = await open(t, { address: "#mode=accuracy&scene=paper" });
  await page.waitForFunction(() => document.querySelectorAll("#levels tbody tr").length === 4);
  const rows = await page.locator("#levels tbody tr").allTextContents();
  for (const row of rows) assert.match(row, /(fast|fine|straightforward|reference).*\d.*[µm]s/);
});

test("send: a text goes, and arrives", async (t) => {
  const page = await open(t, { address: "#mode=send&scene=day&pose.distance_m=40" });
  await page.fill("#message", "Grüße von der Brücke");
  await page.selectOption("#send-pace", "0");
  await page.click("#send-start");
  await textOf(page, "#send-arrived", /Grüße von der Brücke/);
});

test("send: a carrier's flicker stands beside it", async (t) => {
  const page = await open(t, { address: "#mode=send&scene=day&pose.distance_m=40&link.carrier_cycles=16&camera.exposure_s=0.00025" });
  await page.click("#send-start");
  await textOf(page, "#send-numbers", /1440 Hz, 0\.\d+ times the limit of low risk: no visible flicker/);
  await textOf(page, "#send-numbers", /P_st 0\.0[1-9]\d*, SVM 0\.[1-9]\d* \(at 1, half of all people see it\)/);
  await textOf(page, "#send-numbers", /longest flicker period 694\D?µs/);
});

test("send: where nothing arrives it says why", async (t) => {
  const page = await open(t, { address: "#mode=send&scene=night&pose.distance_m=150&camera.width_px=320&camera.height_px=240" });
  await page.selectOption("#send-pace", "0");
  await page.click("#send-start");
  await textOf(page, "#send-advice", /bits were wrong|no panel was read/);
});

test("receive: pictures are decoded as vocc decode does", async (t) => {
  const folder = workshop(t);
  const file = path.join(folder, "one.png");
  const { bits } = JSON.parse(vocc("render", "day", "--out", file, "--json"));
  const page = await open(t, { address: "#mode=receive" });
  await page.setInputFiles("#files", file);
  await textOf(page, "#pictures tbody", new RegExp(bits));
  assert.equal(await page.inputValue("#command"), "vocc decode one.png");
});

test("receive: a y4m film says its text", async (t) => {
  const file = film(workshop(t), 30, FILM);
  const page = await open(t, { address: "#mode=receive" });
  await page.setInputFiles("#files", file);
  await textOf(page, "#texts", new RegExp(TEXT));
  await textOf(page, "#learnt", /\d/);
});

test("receive: a signer is named, and proven by a trusted key alone", async (t) => {
  const folder = workshop(t);
  const key = keyFile(folder);
  const { signer } = JSON.parse(vocc("keys", "show", key, "--json"));
  const words = ["day", "--level", "fast", "--set", "camera.width_px=320", "--set", "camera.height_px=240"];
  words.push("--message", "<b>Ice</b>", "--frames", "120");
  const signed = film(folder, 100, [...words, "--sign", key, "--counter", "41"], "signed.y4m");
  const page = await open(t, { address: "#mode=receive&fps=100&rate=90" });
  const receive = async (file, pattern) => {
    await page.setInputFiles("#files", file);
    await textOf(page, "#texts", pattern);
    await textOf(page, "#receive-state", /^Ended: \d+ messages? came/);
  };
  await receive(signed, new RegExp(`<b>Ice</b>.*signed by ${signer}, not checked, counter 41$`));
  // A text from outside is no markup.
  assert.equal(await page.locator("#texts b").count(), 0);
  await receive(film(folder, 100, words, "unsigned.y4m"), /signature: unsigned$/);

  await page.locator("summary", { hasText: "Check signatures" }).click();
  await page.fill("#keys", vocc("keys", "show", key));
  await receive(signed, new RegExp(`signed by truck 12 \\(${signer}\\), counter 41: proven$`));
  // The page remembers the counter.
  await receive(signed, /counter 41: replayed$/);
  await page.fill("#keys", "<b>");
  await page.setInputFiles("#files", signed);
  await textOf(page, "#alert", /field of public keys holds no public keys/);
});

test("receive: a film that the browser plays says its text", async (t) => {
  const file = film(workshop(t), 30, FILM, "film.webm");
  const page = await open(t, { address: "#mode=receive&fps=30" });
  await page.setInputFiles("#files", file);
  await textOf(page, "#texts", new RegExp(TEXT));
});

test("receive: the webcam films a panel, and the text appears", async (t) => {
  const file = film(workshop(t), 30, FILM);
  const flags = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream", `--use-file-for-fake-video-capture=${file}`];
  const page = await open(t, { address: "#mode=receive&fps=30&rate=27", flags });
  await page.click("#webcam");
  await textOf(page, "#texts", new RegExp(TEXT));
  assert.equal(await page.inputValue("#command"), "vocc receive recording.mp4 --fps 30 --symbol-rate 27");
  // Leaving the mode stops the camera.
  await page.evaluate(() => {
    const open = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices);
    navigator.mediaDevices.getUserMedia = async (wanted) => (window.filming = await open(wanted));
  });
  await page.click("#receive-stop");
  await page.click("#webcam");
  await page.waitForFunction(() => window.filming?.active);
  await page.click("#tab-explore");
  await page.waitForFunction(() => !window.filming.active);
});

test("every setting is in the address", async (t) => {
  const page = await open(t, { address: "#mode=send&scene=day&pose.distance_m=33&seed=9&pace=1000&detector=kmeans" });
  assert.equal(await page.inputValue("#pace"), "1000");
  await page.selectOption("#send-pace", "0");
  await page.fill("#message", "Ice & snow");
  await page.waitForFunction(() => location.hash.includes("sendpace=0") && location.hash.includes("message=Ice+%26+snow"));
  for (const part of ["pose.distance_m=33", "seed=9", "pace=1000", "detector=kmeans"]) assert.ok(page.url().includes(part), page.url());
});

test("a picture that stands at the first frame is shared so", async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=day&frame=7" });
  await page.fill("#frame", "0");
  await page.dispatchEvent("#frame", "change");
  await page.waitForFunction(() => location.hash.includes("frame=0"));
});

test("an address is a scene, and the command gives the same", async (t) => {
  const page = await open(t, { address: "#mode=explore&scene=day&pose.distance_m=33&seed=9&frame=4" });
  const command = await page.inputValue("#command");
  assert.match(command, /vocc render day/);
  for (const part of ["pose.distance_m=33", "--seed 9", "--frame 4"]) assert.ok(command.includes(part), command);
  const folder = workshop(t);
  const drawn = execFileSync("sh", ["-c", `${command.replace(/^vocc/, '"$VOCC"')} --json`], { cwd: folder, encoding: "utf8" });
  const { answer } = await ask(page, { do: "picture", frame: 4 });
  assert.equal(JSON.parse(drawn).bits, answer.sent);
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save-scene")]);
  const file = path.join(folder, "scene.toml");
  writeFileSync(file, readFileSync(await download.path()));
  const said = JSON.parse(vocc("render", file, "--seed", "9", "--frame", "4", "--out", `${file}.png`, "--json"));
  assert.equal(said.bits, JSON.parse(vocc("render", "day", "--set", "pose.distance_m=33", "--seed", "9", "--frame", "4", "--out",
    `${file}.png`, "--json")).bits);
});

test("pictures of the page at three widths, light and dark", async (t) => {
  for (const [width, colorScheme] of [[360, "light"], [800, "dark"], [1400, "light"]]) {
    const page = await open(t, {
      address: "#mode=explore&scene=day&pose.distance_m=50&frame=3",
      context: { viewport: { width, height: 900 }, colorScheme },
    });
    await page.waitForFunction(() => document.querySelectorAll("#plan tbody tr").length > 15);
    const isWide = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
    assert.ok(!isWide, `nothing reaches beyond ${width} px`);
    const tops = await page.locator("[role=tab]").evaluateAll((tabs) => tabs.map((tab) => tab.getBoundingClientRect().top));
    assert.equal(new Set(tops).size, 1, `the tabs stand in one line of ${width} px`);
    await page.screenshot({ path: path.join(shots, `page-${width}.png`) });
  }
});
