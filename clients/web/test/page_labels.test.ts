// SPDX-License-Identifier: Apache-2.0
// The page against the mock server: labels as a list to show and hide by.

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeAndSettle, readAddress, waitForFinal } from "./browser";
import { run, screenshot } from "./page_run";
import type { MockServer } from "./mock_server";

const kFew = { volumes: [{ id: "organs", state: "ready", type: "u8", labels: 12 }] } as const;
const kMany = { volumes: [{ id: "cells", state: "ready", type: "u16", labels: 40000 }] } as const;
const tfOf = (mock: MockServer): string => String(Object.assign({}, ...mock.views)["tf"]);
const row = (text: string): string => `.label-row:has(.label-name:text-is("${text}"))`;

test("labels are listed with colour, name, number and count, hidden by a box, and the address has it", () => run(kFew, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator(".label-status").innerText(), "11 labels");
  assert.equal(await page.innerText(`${row("liver")} .label-fact`), "2 · 200");
  await changeAndSettle(page, () => page.uncheck(`${row("liver")} input`));
  assert.match(tfOf(mock), /^1:000001:0.3,2:000002:0,3:000003:0.3,/);
  assert.equal(await page.locator(".label-status").innerText(), "11 labels, 1 hidden");
  await screenshot(page, "labels");
  assert.equal((await readAddress(page)).get("tf"), tfOf(mock));
  await page.reload();
  await waitForFinal(page);
  assert.equal(await page.isChecked(`${row("liver")} input`), false, "a link has it");
  await changeAndSettle(page, () => page.check(`${row("liver")} input`));
  assert.equal(tfOf(mock), "auto");
  await changeAndSettle(page, () => page.keyboard.press("Control+z"));
  assert.equal(await page.isChecked(`${row("liver")} input`), false);
}));

test("labels are searched, and all found are hidden, shown, or one alone", () => run(kFew, async ({ page, mock }) => {
  await waitForFinal(page);
  await page.fill(".label-search", "kidney");
  assert.deepEqual(await page.locator(".label-name").allInnerTexts(), ["left kidney", "right kidney"]);
  assert.equal(await page.locator(".label-status").innerText(), "2 of 11 found");
  await changeAndSettle(page, () => page.click(".label-none"));
  assert.match(tfOf(mock), /2:000002:0.3,3:000003:0,4:000004:0,6:/);
  await page.fill(".label-search", "1");
  assert.deepEqual(await page.locator(".label-name").allInnerTexts(), ["Label 1", "Label 10", "Label 11", "Label 12"]);
  await page.fill(".label-search", "");
  await changeAndSettle(page, () => page.click(`${row("liver")} button`));
  assert.deepEqual(tfOf(mock).split(",").filter((point) => !point.endsWith(":0")), ["2:000002:0.3"]);
  await changeAndSettle(page, () => page.click(".label-all"));
  assert.equal(tfOf(mock), "auto");
}));

test("of tens of thousands only those in sight are elements, and keys go through them", () => run(kMany, async ({ page, mock }) => {
  await waitForFinal(page);
  assert.equal(await page.locator(".label-status").innerText(), "40,000 labels");
  const count = (): Promise<number> => page.locator(".label-row").count();
  assert.ok((await count()) < 30);
  await page.locator(`${row("liver")} input`).focus();
  await page.keyboard.press("End");
  const focused = (): Promise<string | undefined> => page.evaluate(() => document.activeElement?.closest(".label-row")?.querySelector(".label-name")?.textContent ?? undefined);
  assert.equal(await focused(), "Label 40000");
  await page.keyboard.press("PageUp");
  await page.keyboard.press("ArrowDown");
  assert.match((await focused()) ?? "", /^Label 3999\d$/);
  assert.ok((await count()) < 40);
  const hidden = Number((await focused())?.slice(6));
  await changeAndSettle(page, () => page.keyboard.press("Space"));
  const zeros = tfOf(mock).split(",").filter((point) => point.endsWith(":0")).map((point) => Number(point.split(":")[0]));
  assert.deepEqual(zeros, [hidden]);
  assert.equal(await focused(), `Label ${hidden}`, "the row stays where one is");
  await page.locator(".label-scroller").evaluate((scroller) => { scroller.scrollTop = 20000 * 32; });
  await page.waitForSelector(row("Label 20001"));
  const took = await page.evaluate(() => {
    const begin = performance.now();
    document.querySelector<HTMLElement>(".label-none")?.click();
    return performance.now() - begin;
  });
  assert.ok(took < 500, `${took} ms`);
  await page.waitForFunction(() => /40,000 hidden/.test(document.querySelector(".label-status")?.textContent ?? ""));
}));

test("other volumes have no labels", () => run({}, async ({ page }) => {
  await waitForFinal(page);
  assert.equal(await page.locator(".labels").count(), 0);
}));
