// Pages of this folder in a headless Chromium on a software device. A page reports to the server that it comes from.
import { spawn, spawnSync } from 'node:child_process';
import { createServer } from 'node:http';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

export const ROOT = fileURLToPath(new URL('../..', import.meta.url));
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.json': 'application/json', '.css': 'text/css' };
const NAMES = [process.env.CHROMIUM, 'chromium', 'chromium-browser', 'google-chrome'];
// SwiftShader is a software device, which Chromium offers to pages only when asked to; canvases need Vulkan for it.
const FLAGS = ['--headless=new', '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-features=Vulkan',
  '--use-vulkan=swiftshader', '--use-gl=angle', '--use-angle=swiftshader', '--hide-scrollbars', '--force-color-profile=srgb',
  '--no-first-run', '--disable-background-networking', '--window-size=1400,900'];

function executable() {
  const found = NAMES.find((name) => name && spawnSync(name, ['--version']).status === 0);
  if (!found) throw new Error('no browser: expected chromium, or its path in the variable CHROMIUM');
  return found;
}

/** Serves the folder; `answer(name, body)` gets what pages post to /report/NAME, and returns an answer. */
export function serve(answer = () => '', port = 0) {
  const server = createServer(async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname));
    try {
      if (request.method === 'POST') {
        const parts = [];
        for await (const part of request) parts.push(part);
        response.end(await answer(path.split('/').pop(), Buffer.concat(parts)));
        return;
      }
      const bytes = readFileSync(join(ROOT, path.endsWith('/') ? `${path}index.html` : path));
      response.setHeader('content-type', TYPES[extname(path) || '.html'] ?? 'application/octet-stream');
      response.end(bytes);
    } catch (error) {
      response.statusCode = error.code === 'ENOENT' ? 404 : 500;
      response.end(String(error.stack));
    }
  });
  return new Promise((resolve) => server.listen(port, '127.0.0.1', () => resolve(server)));
}

/** Opens a page and waits for its report `done`, a JSON object; other reports go to `answer`. The limit is for the time between two reports. */
export async function visit(path, { answer = () => '', timeoutS = 600, flags = [] } = {}) {
  let finish;
  const done = new Promise((resolve, reject) => (finish = { resolve, reject }));
  const server = await serve(async (name, body) => {
    timer.refresh();
    if (name !== 'done') return answer(name, body);
    finish.resolve(JSON.parse(body.toString()));
    return '';
  });
  const folder = mkdtempSync(join(tmpdir(), 'chromium-'));
  const root = process.getuid?.() === 0 ? ['--no-sandbox'] : [];
  const url = `http://127.0.0.1:${server.address().port}/${path}`;
  const browser = spawn(executable(), [...FLAGS, ...flags, ...root, `--user-data-dir=${folder}`, url], { stdio: 'ignore' });
  const timer = setTimeout(() => finish.reject(new Error(`${path}: no report within ${timeoutS} s`)), 1000 * timeoutS);
  browser.once('exit', () => finish.reject(new Error(`${path}: the browser has ended`)));
  try {
    return await done;
  } finally {
    clearTimeout(timer);
    const ended = new Promise((resolve) => browser.once('exit', resolve));
    if (browser.exitCode === null && browser.kill('SIGTERM')) await ended;
    server.closeAllConnections();
    server.close();
    rmSync(folder, { recursive: true, force: true, maxRetries: 5 });
  }
}
