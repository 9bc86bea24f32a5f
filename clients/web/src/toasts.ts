// SPDX-License-Identifier: Apache-2.0
// Problems as dismissable notes in the corner. The same problem twice is one note that counts.

import { byId, element, icon } from "./dom";
import type { Problem } from "./protocol";

const kMostToasts = 4;
const kLifeMs = 12000;

interface Toast {
  readonly key: string;
  readonly node: HTMLElement;
  readonly count: HTMLElement;
  times: number;
  timer: number;
}

export class Toasts {
  private readonly holder = byId("toasts", HTMLElement);
  private toasts: Toast[] = [];

  show(problem: Problem): void {
    const key = JSON.stringify(problem);
    const same = this.toasts.find((toast) => toast.key === key);
    if (same !== undefined) {
      same.count.textContent = `×${++same.times}`;
      this.restart(same);
      return;
    }
    this.add(key, problem);
    const oldest = this.toasts[0];
    if (this.toasts.length > kMostToasts && oldest !== undefined) this.remove(oldest);
  }

  private add(key: string, problem: Problem): void {
    const count = element("span", { class: "toast-count" });
    const heading = element("strong", {}, problem.title, " ", count);
    const text = element("div", { class: "toast-text" }, heading);
    if (problem.field !== null) heading.prepend(element("code", {}, problem.field));
    if (problem.detail !== "") text.append(element("p", {}, problem.detail));
    const close = element("button", { class: "icon-button", type: "button", "aria-label": "Dismiss" }, icon("close"));
    const node = element("div", { class: "toast", role: "alert" }, icon("warning"), text, close);
    const toast: Toast = { key, node, count, times: 1, timer: 0 };
    close.addEventListener("click", () => this.remove(toast));
    this.holder.append(node);
    this.toasts.push(toast);
    this.restart(toast);
  }

  private restart(toast: Toast): void {
    window.clearTimeout(toast.timer);
    toast.timer = window.setTimeout(() => this.remove(toast), kLifeMs);
  }

  private remove(toast: Toast): void {
    window.clearTimeout(toast.timer);
    toast.node.remove();
    this.toasts = this.toasts.filter((other) => other !== toast);
  }
}
