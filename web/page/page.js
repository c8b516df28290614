// The document around the picture: controls, files, sizes, messages. The crate beside this folder does the work.

import { follow_input } from "./input.js";

const NO_WEBGPU = "This browser shows no picture: aonet needs WebGPU, and this browser offers none here. Recent versions of " +
    "Chrome, Edge, Firefox and Safari have it, on pages that come over https or from localhost.";
// Larger files do not fit into a page's memory. guess: half of the 4 GiB of 32-bit addresses, for file and scene.
const MOST_BYTES = 2 ** 30;
// Share of the picture's width that has room for a name. guess: the longest is an eighth of a desktop's.
const NAMED = 0.15;
const REFUSES = "The graphics device refuses: ";

const of = (id) => document.getElementById(id);
const canvas = of("picture");
let viewer;

/** Shows a message until the next one; "" shows none. */
function say(text) {
    of("message").textContent = text;
    of("message").hidden = text === "";
}

/** Whether the device has reported an error: pictures after that cannot be trusted. */
function refused() {
    return of("message").textContent.startsWith(REFUSES);
}

/** Shows the last message: nothing can be drawn any more. */
function stop(text) {
    document.body.dataset.state = "stopped";
    say(text);
}

/** After a bug in aonet, or without memory, the viewer cannot continue. */
function fail(error) {
    if (error instanceof WebAssembly.RuntimeError || error.message.startsWith("panicked")) {
        stop(`aonet has failed: ${error.message}. Load the page again to go on.`);
    } else {
        say(error.message);
    }
}

const frames = {
    wanted: false,
    running: false,
    drawn: 0,

    /** Something has changed. */
    want() {
        this.wanted = true;
        if (!this.running && viewer && document.body.dataset.state !== "stopped") {
            this.run();
        }
    },

    /** One frame at a time, as long as something changes. */
    async run() {
        this.running = true;
        document.body.dataset.state = "drawing";
        while (this.wanted && document.body.dataset.state !== "stopped") {
            this.wanted = false;
            await new Promise(requestAnimationFrame);
            try {
                fit();
                const end = viewer.draw();
                // The picture can be read until the browser has shown it.
                canvas.dispatchEvent(new Event("draw"));
                await end;
                this.wanted ||= viewer.converges();
            } catch (error) {
                fail(error);
            }
            document.body.dataset.drawn = ++this.drawn;
            tell();
        }
        this.running = false;
        if (document.body.dataset.state === "drawing") {
            document.body.dataset.state = "resting";
        }
    },
};

/** Shows the times of the picture and its view. */
function tell() {
    of("times").textContent = `${canvas.width} x ${canvas.height} pixels. ${viewer.times()}`;
    of("view").textContent = viewer.view();
}

/** Gives the canvas as many pixels as the controls request. */
function fit() {
    const scale = devicePixelRatio * Number(of("scale").value);
    const sides = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * scale)));
    if (sides[0] !== canvas.width || sides[1] !== canvas.height) {
        viewer.resize(...sides);
        [canvas.width, canvas.height] = sides;
    }
}

/** Applies a change to the viewer and shows the result or the error. */
function change(what) {
    try {
        what(viewer);
        if (!refused()) {
            say("");
        }
    } catch (error) {
        fail(error);
    }
    frames.want();
}

/** Sets the chosen methods and shows their names on the picture. */
function show_methods(viewer) {
    viewer.set_methods(of("left").value, of("right").value);
    for (const side of ["left", "right"]) {
        of(`${side}_name`).textContent = of(side).selectedOptions[0].textContent;
    }
}

function show_split(viewer) {
    const split = Number(of("split").value);
    viewer.set_split(split);
    of("left_name").hidden = split < NAMED;
    of("right_name").hidden = split > 1 - NAMED;
}

function show_radius() {
    const digits = viewer.radius() < 0.1 ? 3 : 2;
    of("radius_text").value = `${viewer.radius().toFixed(digits)} units`;
    of("radius").value = Math.log10(viewer.radius() / viewer.scene_radius());
}

async function open_file(file) {
    if (!file) {
        return;
    }
    if (file.size > MOST_BYTES) {
        say(`${file.name}: expected at most ${MOST_BYTES} bytes, found ${file.size}`);
        return;
    }
    try {
        const bytes = new Uint8Array(await file.arrayBuffer());
        let missing = "";
        change((viewer) => {
            viewer.open(file.name, bytes);
            missing = viewer.missing();
        });
        if (missing) {
            say(`${file.name}: ${missing}`);
        }
    } catch (error) {
        say(`${file.name}: ${error.message}`);
    }
    show_radius();
}

function listen() {
    of("left").onchange = of("right").onchange = () => change(show_methods);
    of("show").onchange = () => change((viewer) => viewer.set_show(of("show").value));
    of("guard_band").onchange = () => change((viewer) => viewer.set_margin(Number(of("guard_band").value)));
    of("second_layer").onchange = () => change((viewer) => viewer.set_second(of("second_layer").value !== "none"));
    of("split").oninput = () => change(show_split);
    of("scale").onchange = () => frames.want();
    of("radius").oninput = () => {
        change((viewer) => viewer.set_radius(viewer.scene_radius() * 10 ** Number(of("radius").value)));
        show_radius();
    };
    of("file").onchange = () => open_file(of("file").files[0]);
    of("controls").onsubmit = (event) => event.preventDefault();
    follow_input(canvas, change, {
        at: () => Number(of("split").value),
        move(split) {
            of("split").value = split;
            change(show_split);
        },
    });
    new ResizeObserver(() => frames.want()).observe(canvas);
    for (const [name, over] of [["dragover", true], ["dragleave", false], ["drop", false]]) {
        addEventListener(name, (event) => {
            event.preventDefault();
            document.body.classList.toggle("drop", over);
        });
    }
    addEventListener("drop", (event) => open_file(event.dataTransfer.files[0]));
}

function fill(select, names, titles, chosen) {
    select.replaceChildren(...names.map((name, i) => new Option(titles[i], name, false, name === chosen)));
}

/** Shows errors of the device as they arrive. */
async function hear() {
    for (;;) {
        const sentence = await viewer.next_error();
        if (sentence.startsWith("lost: ")) {
            return stop(`The graphics device is gone (${sentence.slice(6)}). Load the page again to go on.`);
        }
        console.error(sentence);
        // Errors that follow from the first one are not useful.
        if (!refused()) {
            say(`${REFUSES}${sentence}`);
        }
    }
}

async function start() {
    const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
    if (!adapter) {
        return stop(NO_WEBGPU);
    }
    const aonet = await import("./aonet_web.js");
    await aonet.default();
    viewer = await aonet.Viewer.create(canvas, navigator.gpu.getPreferredCanvasFormat());
    const [names, titles, shows] = [aonet.method_names(), aonet.method_titles(), aonet.show_names()];
    fill(of("left"), names, titles, "off");
    fill(of("right"), names, titles, "balanced");
    fill(of("show"), shows, shows, "shaded");
    listen();
    hear();
    show_radius();
    change((viewer) => {
        show_methods(viewer);
        show_split(viewer);
    });
}

start().catch((error) => stop(`aonet cannot start: ${error.message}`));
