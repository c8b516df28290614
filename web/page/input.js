// Mouse, touch and keyboard: they move the viewer and the border.

// Radians per height of the canvas. guess: half a turn over a screen.
const TURN = 3;
// Factor of the distance per notch of the wheel or key.
const NEARER = 0.9;
// Radians, and parts of the distance, per key.
const STEP = 0.08;
// Distance from the border that still grabs it (px). guess: half a finger; a comfortable aim for a mouse.
const NEAR = { touch: 16, mouse: 6 };

/**
 * Calls `move(viewer => ..)` when the mouse, a finger or a key on the canvas moves the viewer. `border.at()` returns the border's
 * place as a share of the canvas's width; `border.move(share)` sets it.
 */
export function follow_input(canvas, move, border) {
    const fingers = new Map();
    // The pointer that holds the border.
    let holder = null;
    const share = (event) => (event.clientX - canvas.getBoundingClientRect().left) / canvas.clientWidth;
    const near = (event) =>
        Math.abs(share(event) - border.at()) * canvas.clientWidth < (NEAR[event.pointerType] ?? NEAR.mouse);

    canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        if (holder === null && fingers.size === 0 && near(event)) {
            holder = event.pointerId;
        } else {
            fingers.set(event.pointerId, event);
        }
    });
    for (const end of ["pointerup", "pointercancel"]) {
        canvas.addEventListener(end, (event) => {
            fingers.delete(event.pointerId);
            holder = holder === event.pointerId ? null : holder;
        });
    }
    canvas.addEventListener("pointermove", (event) => {
        canvas.style.cursor = holder !== null || (fingers.size === 0 && near(event)) ? "ew-resize" : "";
        if (event.pointerId === holder) {
            border.move(Math.min(Math.max(share(event), 0), 1));
            return;
        }
        const last = fingers.get(event.pointerId);
        if (!last) {
            return;
        }
        const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
        // Two fingers each move half as much.
        const unit = canvas.clientHeight * (other ? 2 : 1);
        const x = (event.clientX - last.clientX) / unit;
        const y = (event.clientY - last.clientY) / unit;
        fingers.set(event.pointerId, event);
        if (other) {
            const apart = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY);
            const factor = Math.max(apart(last), 1) / Math.max(apart(event), 1);
            move((viewer) => (viewer.pan(-x, y), viewer.zoom(factor)));
        } else if (event.shiftKey || event.buttons & 6) {
            move((viewer) => viewer.pan(-x, y));
        } else {
            move((viewer) => viewer.turn(-TURN * x, -TURN * y));
        }
    });
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        move((viewer) => viewer.zoom(event.deltaY > 0 ? 1 / NEARER : NEARER));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());

    canvas.addEventListener("keydown", (event) => {
        const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        const factor = { "+": NEARER, "=": NEARER, "-": 1 / NEARER }[event.key];
        if (event.ctrlKey || event.metaKey || event.altKey || !(way || factor)) {
            return;
        }
        event.preventDefault();
        if (factor) {
            move((viewer) => viewer.zoom(factor));
        } else if (event.shiftKey) {
            move((viewer) => viewer.pan(STEP * way[0], STEP * way[1]));
        } else {
            move((viewer) => viewer.turn(STEP * way[0], -STEP * way[1]));
        }
    });
}
