// How long it takes in the page from an action until what it changes is painted.
window.watch = {
  text: (id) => document.querySelector(`[data-testid=${id}]`)?.innerText ?? "",
  button: (name) => [...document.querySelectorAll("button")].find((b) => b.innerText.trim() === name && b.offsetParent),
  plot: () => [...document.querySelectorAll(".js-plotly-plot")].find((p) => p.offsetParent)?.calcdata,
  points() {
    let count = 0;
    __viserMutable.nodeRefFromName["/points/kept"]?.traverse((o) => {
      count = Math.max(count, o.instancesCount ?? 0);
    });
    return count;
  },
  arm: () => JSON.stringify(__viserMutable.nodeRefFromName["/arm/link6"].matrixWorld.elements),
  // Resolves after the picture in which the condition holds for the first time has been painted.
  painted: (holds) =>
    new Promise((done) => {
      const channel = new MessageChannel();
      channel.port1.onmessage = () => done(performance.now());
      const look = () => (holds() ? channel.port2.postMessage(0) : requestAnimationFrame(look));
      requestAnimationFrame(look);
    }),
  async timed(act, changes) {
    const before = changes.map((c) => c());
    const start = performance.now();
    act();
    const holds = () => changes.every((c, k) => c() !== before[k]);
    return (await watch.painted(holds)) - start;
  },
  // A shot: the command for the next one, the verdict with the residual, the point in the scene, the plot.
  measure: () =>
    watch.timed(() => watch.button("Measure").click(), [
      () => watch.text("step"),
      () => watch.text("verdict"),
      watch.points,
      watch.plot,
    ]),
  // A solution: words with findings, and the plot that is open.
  solve: () =>
    watch.timed(() => watch.button("Solve").click(), [
      () => document.querySelector("[data-testid=findings]"),
      watch.plot,
    ]),
  slide: (thumb) =>
    watch.timed(
      () => thumb.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", code: "ArrowRight", bubbles: true })),
      [watch.arm],
    ),
};
