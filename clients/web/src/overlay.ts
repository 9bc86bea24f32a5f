// SPDX-License-Identifier: Apache-2.0
// The cover over the picture while there is none to show, or while the one there is may be out of date.

import { byId } from "./dom";
import type { Notice } from "./notice";

export class Overlay {
  private readonly root = byId("overlay", HTMLElement);
  private readonly title = byId("overlay-title", HTMLElement);
  private readonly detail = byId("overlay-detail", HTMLElement);

  show(notice: Notice | null): void {
    this.root.hidden = notice === null;
    if (notice === null) return;
    this.root.dataset["kind"] = notice.kind;
    this.title.textContent = notice.title;
    this.detail.textContent = notice.detail;
  }
}
