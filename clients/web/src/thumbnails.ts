// SPDX-License-Identifier: Apache-2.0
// Small pictures of volumes, asked for when they come into sight and few at a time: each is work for the server.

const kAtOnce = 2;

export class Thumbnails {
  private readonly waiting: HTMLImageElement[] = [];
  private readonly observer: IntersectionObserver;
  private readonly ready = new Map<string, HTMLImageElement>(); // by volume, so that a list that is built again asks nothing again
  private loading = 0;

  constructor(private readonly address: (id: string) => string) {
    this.observer = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        if (!isIntersecting || !(target instanceof HTMLImageElement)) continue;
        this.observer.unobserve(target);
        this.waiting.push(target);
      }
      this.next();
    });
  }

  // Where nothing comes it stays empty.
  of(id: string): HTMLImageElement {
    const known = this.ready.get(id);
    if (known !== undefined) return known;
    const image = document.createElement("img");
    image.alt = "";
    image.className = "thumbnail";
    image.dataset["volume"] = id;
    image.dataset["address"] = `${this.address(id)}?size=64x64&format=jpeg`;
    this.ready.set(id, image);
    this.observer.observe(image);
    return image;
  }

  private next(): void {
    while (this.loading < kAtOnce) {
      const image = this.waiting.shift();
      if (image === undefined) return;
      this.loading++;
      const done = (): void => {
        this.loading--;
        this.next();
      };
      image.addEventListener("load", done, { once: true });
      image.addEventListener("error", () => {
        image.classList.add("absent");
        this.ready.delete(image.dataset["volume"] ?? ""); // asked again when the list is built again
        done();
      }, { once: true });
      image.src = image.dataset["address"] ?? "";
    }
  }
}
