// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: what a view says, in controls, messages and the address.

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeAndSettle, chooseVolume, difference, dragThumb, partOf, readAddress, readPicture, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";

test("the range follows thumbs, keys and number fields, and refuses nonsense", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  const home = await readPicture(page);
  await changeAndSettle(page, () => dragThumb(page, "lo", 0.5));
  assert.ok(difference(home, await readPicture(page)) > 0.05);
  assert.deepEqual(mock.views.at(-1)?.["range"], [130, 250]);
  await page.focus(partOf(0, ".thumb.hi"));
  await changeAndSettle(page, () => page.keyboard.press("ArrowLeft"));
  assert.deepEqual(mock.views.at(-1)?.["range"], [130, 249]);
  await page.fill(partOf(0, ".value-lo"), "300");
  await changeAndSettle(page, () => page.keyboard.press("Tab"));
  assert.deepEqual(mock.views.at(-1)?.["range"], [300, 300], "the other bound goes along");
  assert.match(await page.innerText(partOf(0, ".note")), /no values there: the data has 10 to 250/);
  assert.equal(await page.inputValue(partOf(0, ".value-hi")), "300");
  await page.fill(partOf(0, ".value-hi"), "249");
  await changeAndSettle(page, () => page.keyboard.press("Tab"));
  assert.deepEqual(mock.views.at(-1)?.["range"], [249, 249]);
  assert.equal(await page.locator(partOf(0, ".note")).isVisible(), false);
  const count = mock.views.length;
  await page.fill(partOf(0, ".value-lo"), "many");
  await page.keyboard.press("Tab");
  assert.match(await page.innerText(partOf(0, ".fault")), /number/);
  assert.equal(await page.inputValue(partOf(0, ".value-lo")), "many", "what is wrong stays to be read");
  await screenshot(page, "range-fault");
  assert.equal(mock.views.length, count, "a bound that is refused is not sent");
  await page.fill(partOf(0, ".value-lo"), "42");
  await changeAndSettle(page, () => page.keyboard.press("Enter"));
  assert.deepEqual(mock.views.at(-1)?.["range"], [42, 249]);
  assert.equal(await page.locator(partOf(0, ".fault")).isVisible(), false);
}));

test("mode, extinction and background are sent, and stand in the address", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => page.locator("#extinction").fill("900"));
  assert.equal(mock.views.at(-1)?.["extinction"], 4);
  await changeAndSettle(page, () => page.check("input[value=ffffff]"));
  await changeAndSettle(page, () => page.check("input[value=first-hit]"));
  assert.equal(await page.locator("#extinction").isVisible(), false, "only blending has an extinction");
  const address = await readAddress(page);
  assert.deepEqual([address.get("mode"), address.get("background"), address.get("extinction")], ["first-hit", "ffffff", "4"]);
  await screenshot(page, "white");
}));

test("undo goes past a view that was refused, however late", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => page.check("#lit"));
  await page.waitForTimeout(500);
  mock.refused = { member: "mode", value: "mean" };
  mock.refusalAfterMs = 700;
  await page.check("input[value=mean]");
  await page.waitForSelector(".toast");
  assert.equal(await page.isChecked("input[value=blend]"), true);
  assert.equal(mock.views.filter((view) => view["mode"] === "mean").length, 1);
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.equal(await page.isChecked("#lit"), false, "the step before");
  assert.equal(await page.isDisabled("#undo-button"), true);
  await changeAndSettle(page, () => page.keyboard.press("Control+Shift+z"));
  assert.equal(await page.isDisabled("#redo-button"), true);
  assert.equal(mock.views.filter((view) => view["mode"] === "mean").length, 1, "it is not sent again");
}));

test("a view that is too long is not sent, and one that the server finds too long is not sent again", () => run({ hash: "#volume=vessels&mode=mip" }, async ({ page, mock }) => {
  await waitForFinal(page);
  const count = mock.views.length;
  await page.evaluate(() => void (location.hash = `#volume=vessels&mode=blend&walk=${"x".repeat(70000)}`));
  await page.waitForSelector(".toast");
  assert.match(await page.innerText(".toast"), /walk\s*This view is too long to be sent[\s\S]*it takes 70\d\d\d bytes, and the server reads 65536; it stays as it was/);
  await waitForFinal(page);
  assert.equal(await page.isChecked("input[value=blend]"), true, "what is not to blame stays");
  assert.equal((await readAddress(page)).has("walk"), false);
  assert.ok(mock.views.slice(count).every((view) => String(view["walk"] ?? "").length < 100));
  assert.equal(mock.attempts, 1, "the stream stays");
  mock.ended = { member: "mode", value: "mean" };
  await page.click("input[value=mean]"); // it may be taken back before it is looked at
  await page.waitForFunction(() => document.querySelectorAll(".toast").length === 2);
  await page.waitForTimeout(1500);
  await waitForFinal(page);
  assert.equal(await page.isChecked("input[value=blend]"), true);
  assert.equal(mock.attempts, 2, "one connection more");
  assert.equal(mock.views.filter((view) => view["mode"] === "mean").length, 1);
}));

test("a surface has a value within a narrow range far from 0", () => run({ hash: "#volume=vessels&mode=iso&range=101300:101350" }, async ({ page, mock }) => {
  await waitForFinal(page);
  const values: unknown[] = [];
  for (const position of ["0", "247", "248", "1000"]) {
    await changeAndSettle(page, () => page.fill("#iso", position));
    values.push(mock.views.at(-1)?.["iso"]);
  }
  assert.deepEqual(values, [101300, 101312.35, 101312.4, 101350]);
  assert.equal(await page.inputValue("#iso"), "1000");
}));

test("a member that is refused goes back everywhere, and what came with it stays", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  mock.refused = { member: "background", value: "ffffff" };
  await changeAndSettle(page, () => page.evaluate(() => {
    // both within one frame, so in one message
    for (const value of ["ffffff", "mip"]) document.querySelector<HTMLInputElement>(`input[value=${value}]`)?.click();
  }));
  const [refused, repeated] = mock.views.slice(-2);
  assert.deepEqual([refused?.["background"], refused?.["mode"]], ["ffffff", "mip"]);
  assert.deepEqual([repeated?.["background"], repeated?.["mode"]], ["000000", "mip"]);
  assert.match(await page.innerText(".toast"), /not today/);
  assert.deepEqual([await page.isChecked("input[value='000000']"), await page.isChecked("input[value=mip]")], [true, true]);
  assert.equal((await readAddress(page)).get("background"), "000000");
  const count = mock.views.length;
  await page.waitForTimeout(200);
  assert.equal(mock.views.length, count);
  mock.refused = { member: "tf", value: "inferno" };
  await page.selectOption("#preset", "inferno");
  await page.waitForFunction(() => document.querySelector<HTMLSelectElement>("#preset")?.value === "auto");
  assert.equal((await readAddress(page)).has("tf"), false);
}));

test("a link that is refused is shown without what is refused", () => run({ hash: "#volume=vessels&tf=inferno&mode=mip&range=20:30" }, async ({ page, mock }) => {
  mock.refused = { member: "tf", value: "inferno" };
  await page.reload();
  await waitForFinal(page);
  const { tf, mode, range } = mock.views.at(-1) ?? {};
  assert.deepEqual({ tf, mode, range }, { tf: "auto", mode: "mip", range: [20, 30] });
  assert.match(await page.innerText(".toast"), /not today/);
  assert.equal(await page.locator("#readout").isVisible(), true);
}));

test("whatever a view may say works in the address, and the rest is named", () => run({ hash: "#volume=vessels&clip=0,0,0,50,50,50&samples=4&ortho=90&tf=10:000000:0,90:ff0000:0.5&colour=red" }, async ({ page, mock }) => {
  await waitForFinal(page);
  const { clip, samples, ortho, fov, tf } = mock.views[0] ?? {};
  assert.deepEqual({ clip, samples, ortho, fov, tf }, { clip: [0, 0, 0, 50, 50, 50], samples: "4", ortho: 90, fov: undefined, tf: "10:000000:0,90:ff0000:0.5" });
  assert.match(await page.innerText(".toast"), /colour: is no member of a view/);
  await changeAndSettle(page, () => page.mouse.wheel(0, -300));
  const eyes = mock.views.map((view) => view["ortho"]);
  assert.ok(Number(eyes.at(-1)) < 90, "a parallel picture comes closer by its height");
  await changeAndSettle(page, () => page.evaluate(() => {
    const written = location.hash;
    location.hash = "#volume=vessels&samples=1&clip=none";
    history.replaceState(null, "", written); // as the page does a while after a change of the view
  }));
  assert.deepEqual([mock.views.at(-1)?.["samples"], mock.views.at(-1)?.["clip"]], ["1", "none"]);
}));

test("a select has its own use for arrows and letters", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.focus("#preset");
  const count = mock.views.length;
  for (const key of ["p", "f", "r"]) await page.keyboard.press(key);
  assert.equal(await page.evaluate(() => document.body.classList.contains("panel-open")), true);
  await changeAndSettle(page, () => page.keyboard.press("ArrowDown"));
  assert.deepEqual(mock.views.slice(count).map((view) => Object.keys(view).sort().join()), mock.views.slice(count).map(() => "id,tf,type"));
}));

test("presets in Hounsfield units are not offered for other values", () => run({ hash: "#volume=vessels" }, async ({ page }) => {
  await waitForFinal(page);
  const offered = await page.locator("#preset option:not([hidden])").evaluateAll((all) => all.map((option) => (option as HTMLOptionElement).value));
  assert.deepEqual(offered, ["auto", "grey", "viridis", "cividis", "inferno", "colour"]);
}));

test("light, smoothing and the surface's value are sent, and stand in the address", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator("#iso").isVisible(), false);
  await changeAndSettle(page, () => page.check("input[value=iso]"));
  await changeAndSettle(page, () => page.check("#smooth"));
  await changeAndSettle(page, () => page.check("#lit"));
  await changeAndSettle(page, () => page.locator("#iso").fill("250"));
  const { mode, filter, lit, iso } = Object.assign({}, ...mock.views) as Record<string, unknown>;
  assert.deepEqual({ mode, filter, lit, iso }, { mode: "iso", filter: "linear", lit: true, iso: 70 });
  const address = await readAddress(page);
  assert.deepEqual([address.get("filter"), address.get("lit"), address.get("iso")], ["linear", "on", "70"]);
  assert.equal(await page.locator("#preset").isVisible(), false, "colours are the volume's own");
  await screenshot(page, "surface");
}));

test("light is set where there is light: its parts, its side, a shadow, what is near", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator("#light-block").isVisible(), false);
  await changeAndSettle(page, () => page.check("#lit"));
  assert.equal(await page.locator("#light-block").isVisible(), true);
  assert.deepEqual([await page.inputValue("#light-ambient"), await page.inputValue("#light-azimuth"), await page.inputValue("#light-height")], ["0.3", "-45", "35"]);
  await changeAndSettle(page, () => page.locator("#light-key").fill("0.8"));
  assert.equal(mock.views.at(-1)?.["light"], "0.3,0.4,0.8,0.2");
  await changeAndSettle(page, () => page.locator("#light-azimuth").fill("90"));
  assert.equal(mock.views.at(-1)?.["key-light"], "0.8192,0.5736,0");
  assert.equal(await page.inputValue("#light-height"), "35", "the other angle stays");
  await changeAndSettle(page, () => page.check("#shadow"));
  assert.equal(mock.views.at(-1)?.["shadow"], "on");
  assert.equal(await page.isDisabled("#occlusion-reach"), true);
  await changeAndSettle(page, () => page.check("#occlusion"));
  assert.equal(mock.views.at(-1)?.["occlusion"], "16");
  await changeAndSettle(page, () => page.locator("#occlusion-reach").fill("0"));
  assert.equal(mock.views.at(-1)?.["occlusion"], "1");
  const address = await readAddress(page);
  assert.deepEqual(["light", "key-light", "shadow", "occlusion"].map((name) => address.get(name)), ["0.3,0.4,0.8,0.2", "0.8192,0.5736,0", "on", "1"]);
  await screenshot(page, "light");
  await changeAndSettle(page, () => page.click("#light-reset"));
  assert.deepEqual(["light", "shadow", "occlusion"].map((name) => mock.views.at(-1)?.[name]), ["0.3,0.4,0.3,0.2", "off", "off"]);
  assert.equal(await page.isDisabled("#light-reset"), true);
  await changeAndSettle(page, () => page.check("input[value=mip]"));
  assert.equal(await page.locator("#light-block").isVisible(), false, "a maximum has no light");
}));

test("a lens has several rays, and a parallel view none", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await changeAndSettle(page, () => page.locator("#aperture").fill("500"));
  const { aperture, samples } = Object.assign({}, ...mock.views) as Record<string, unknown>;
  assert.ok(Number(aperture) > 0);
  assert.equal(samples, "16");
  await changeAndSettle(page, () => page.check("#ortho"));
  assert.equal(mock.views.at(-1)?.["aperture"], "0");
  assert.equal(await page.locator("#lens-block").isVisible(), false);
  assert.equal((await readAddress(page)).get("aperture"), null);
}));

test("the attenuation is there in its mode alone, is sent, and stands in the address", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator("#attenuation").isVisible(), false);
  await changeAndSettle(page, () => page.check("input[value=minip]"));
  assert.equal(mock.views.at(-1)?.["mode"], "minip");
  assert.equal(await page.locator("#attenuation").isVisible(), false);
  await changeAndSettle(page, () => page.check("input[value=attenuated-mip]"));
  assert.equal(await page.innerText("#attenuation-value"), "0.05");
  await changeAndSettle(page, () => page.locator("#attenuation").fill("500"));
  const { mode, attenuation } = Object.assign({}, ...mock.views) as Record<string, unknown>;
  assert.deepEqual({ mode, attenuation }, { mode: "attenuated-mip", attenuation: "0.1" });
  const address = await readAddress(page);
  assert.deepEqual([address.get("mode"), address.get("attenuation")], ["attenuated-mip", "0.1"]);
  await screenshot(page, "attenuation");
  await changeAndSettle(page, () => page.locator("#attenuation").dblclick());
  assert.equal(mock.views.at(-1)?.["attenuation"], "0.05");
  assert.equal((await readAddress(page)).get("attenuation"), null);
}));

test("no attenuation at all is at the slider's end", () => run({ hash: "#mode=attenuated-mip&attenuation=0" }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(mock.views.at(-1)?.["attenuation"], "0");
  assert.deepEqual([await page.inputValue("#attenuation"), await page.innerText("#attenuation-value")], ["0", "0"]);
}));

test("a scalar volume has no extinction, and the choice is in the address and the history", () => run({}, async ({ page, mock }) => {
  await waitForFinal(page);
  await chooseVolume(page, "vessels");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  await waitForFinal(page);
  assert.equal("extinction" in (mock.views.at(-1) ?? {}), false);
  assert.equal(await page.locator("#extinction").isVisible(), false);
  await changeAndSettle(page, async () => void (await page.selectOption("#preset", "viridis")));
  assert.equal(mock.views.at(-1)?.["tf"], "viridis");
  assert.equal((await readAddress(page)).get("tf"), "viridis");
  assert.equal((await readAddress(page)).get("volume"), "vessels");
  await page.goBack();
  await page.waitForFunction(() => document.title.startsWith("fossil"));
  await waitForFinal(page);
}));

test("what few need is folded away, and is in the address", () => run({ hash: "#volume=vessels" }, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator("input[value=blocks]").isVisible(), false);
  await page.click("#advanced summary");
  await changeAndSettle(page, async () => void (await page.selectOption("select[name=samples]", "16")));
  assert.equal(mock.views.at(-1)?.["samples"], "16");
  await changeAndSettle(page, async () => void (await page.selectOption("select[name=finder]", "octree")));
  assert.deepEqual([(await readAddress(page)).get("samples"), (await readAddress(page)).get("finder")], ["16", "octree"]);
  await changeAndSettle(page, async () => void (await page.selectOption("select[name=samples]", "1")));
  assert.equal(mock.views.at(-1)?.["samples"], "1");
  assert.equal((await readAddress(page)).has("samples"), false);
}));

test("the address restores the view", () => run({ hash: "#volume=fossil&eye=48,40,300&target=48,40,64&up=0,1,0&range=77:200&mode=blocks" }, async ({ page, mock }) => {
  await waitForFinal(page);
  const { eye, range, mode } = mock.views[0] ?? {};
  assert.deepEqual({ eye, range, mode }, { eye: [48, 40, 300], range: [77, 200], mode: "blocks" });
  assert.equal(await page.inputValue(partOf(0, ".value-lo")), "77");
  assert.equal(await page.isChecked("input[value=blocks]"), true);
  assert.equal((await readAddress(page)).get("eye"), "48,40,300");
}));

test("what the address gets wrong is said, and the rest is shown", () => run({ hash: "#volume=fossil&range=9:3&size=9x9" }, async ({ page }) => {
  await waitForFinal(page);
  assert.match(await page.innerText(".toast"), /range: expected.*\nsize: the page draws/, "once, all of it");
}));

test("a volume comes back as it was left, also once the page was loaded again", () => run({ hash: "#volume=vessels" }, async ({ page }) => {
  const shows = (mode: string): Promise<boolean> => page.isChecked(`input[name=mode][value=${mode}]`);
  await waitForFinal(page);
  await changeAndSettle(page, () => page.check("input[name=mode][value=mip]", { force: true }));
  const eye = (await readAddress(page)).get("eye");
  await chooseVolume(page, "fossil");
  await page.waitForFunction(() => document.title.startsWith("fossil"));
  await waitForFinal(page);
  await changeAndSettle(page, () => page.check("input[name=mode][value=blend]", { force: true }));
  await page.waitForFunction(() => location.hash.includes("mode=blend")); // it is written a while after
  await page.reload();
  await waitForFinal(page);
  await chooseVolume(page, "vessels");
  await page.waitForFunction(() => document.title.startsWith("vessels"));
  await waitForFinal(page);
  assert.deepEqual([await shows("mip"), (await readAddress(page)).get("eye")], [true, eye]);
  await chooseVolume(page, "fossil");
  await page.waitForFunction(() => document.title.startsWith("fossil"));
  await waitForFinal(page);
  assert.equal(await shows("blend"), true);
}));
