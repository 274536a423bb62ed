"""The least contrast of text on a page, measured in the browser as WCAG 2 defines it.

Used by the tests of the desk and by benchmarks/desk.py.
"""

LEAST_CONTRAST = """() => {
    // Styles come as rgb(), rgba() or color-mix(); a canvas knows them all.
    const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    const read = (colour) => {
        context.clearRect(0, 0, 1, 1);
        context.fillStyle = colour;
        context.fillRect(0, 0, 1, 1);
        const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
        return [r, g, b, a / 255];
    };
    const over = ([r, g, b, a], below) => [r, g, b].map((v, k) => v * a + below[k] * (1 - a));
    const light = (colour) => {
        const [r, g, b] = colour.map((v) => v / 255)
            .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const backOf = (element) => {
        const layers = [];
        for (let e = element; e; e = e.parentElement) {
            layers.push(read(getComputedStyle(e).backgroundColor));
        }
        return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255]);
    };
    const opacityOf = (element) => {
        let opacity = 1;
        for (let e = element; e; e = e.parentElement) {
            opacity *= Number(getComputedStyle(e).opacity);
        }
        return opacity;
    };
    let worst = { contrast: 21, text: "" };
    for (const element of document.querySelectorAll("body *")) {
        const own = [...element.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim())
            || element.matches("select, input:not([type=range], [type=checkbox])");
        const off = element.closest(":disabled, [data-disabled], [aria-disabled=true]");
        if (!own || off || !element.checkVisibility({ visibilityProperty: true })) continue;
        const box = element.getBoundingClientRect();
        if (!box.width || !box.height) continue;
        const back = backOf(element);
        const [r, g, b, a] = read(getComputedStyle(element).color);
        const [x, y] = [light(over([r, g, b, a * opacityOf(element)], back)), light(back)];
        const contrast = (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05);
        if (contrast < worst.contrast) {
            const said = element.textContent.trim().slice(0, 30);
            worst = { contrast, text: `${element.tagName}.${element.className}: ${said}` };
        }
    }
    return worst;
}"""
