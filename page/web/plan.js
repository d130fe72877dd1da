/** The plan: the simulated effects with bound, reason and cost. */

/** The measured cost of each effect on this computer; null if measuring failed. @type {Map<string, {us: number}> | null} */
let measuredCosts = new Map();

/** Time limit for measuring costs on a slow computer. */
const COSTS_PATIENCE_MS = 60_000;

let isMeasuring = false;

/** Measures costs once the settings are stable and no frames run, because it takes a few seconds. Frames are drawn as in `vocc plan`. */
const measureCosts = whenRested(1500, async () => {
  if (settings.fields.mode !== "explore" || !scene.opened || scene.isStale || isMeasuring) return;
  const opened = scene.opened;
  isMeasuring = true;
  try {
    await counter.ask({ ...openRequest(), level: "fast" });
    const { answer } = await counter.ask({ do: "costs" }, undefined, COSTS_PATIENCE_MS);
    measuredCosts = new Map(answer.costs.map((/** @type {any} */ cost) => [cost.effect, cost]));
  } catch (error) {
    // The table reports the failure; the rest of the page needs no costs.
    if (!(error instanceof GivenUp)) measuredCosts = null;
  } finally {
    isMeasuring = false;
  }
  if (scene.opened === opened) showPlan(opened);
  else measureCosts();
});

/** Stops measuring when the user leaves Explore. */
function stopCosts() {
  if (isMeasuring) counter.end();
}

/** @param {any} opened */
function planChanged(opened) {
  // Old measurements are shown until there are new ones, because most costs change little.
  showPlan(opened);
  measureCosts();
}

/** @param {any} opened */
function showPlan(opened) {
  const rows = opened.plan.map((/** @type {any} */ part) => {
    const measured = measuredCosts?.get(part.effect);
    const mode = part.mode === "auto" ? "" : ` (told ${part.mode})`;
    const isKnown = measured && Number.isFinite(measured.us);
    const microseconds = isKnown ? `${measured.us <= 0 ? "≈ 0" : short(measured.us, 2)} µs; ` : measuredCosts ? "" : "not measured; ";
    const drawn = part.included ? "✓ yes" : "no";
    return {
      cells: [part.effect.replace(/_/g, " "), drawn + mode, part.bound_grey, part.why, microseconds + part.cost],
      kind: part.included ? "yes" : "no",
      title: `${part.model}; keys: ${part.keys.join(", ")}`,
    };
  });
  fillTable(byId("plan"), rows);
  const drawn = `the way of drawing (${settings.fields.level}) at most ${short(opened.error_bound_grey, 2)}`;
  const included = opened.plan.filter((/** @type {any} */ part) => part.included);
  const left = short(opened.left_out_grey, 2);
  const tolerance = short(opened.plan[0]?.tolerance_grey ?? 0.5);
  byId("plan-summary").textContent = `${included.length} of ${opened.plan.length} effects are drawn. Each has a bound: what leaving it ` +
    `out would change at most, in grey levels of 255. Where that is more than ${tolerance}, it is drawn. ` +
    `All that is left out changes at most ${left}, ${drawn}.`;
}
