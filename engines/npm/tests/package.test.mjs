// The package as people install it: its files, its size, its types, and the README's first commands.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync, readdirSync, symlinkSync, mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';
import { ROOT } from './support/chromium.mjs';
import { inFolder } from './support/cpu.mjs';
import { blocks } from './support/readme.mjs';

/** Most bytes of code, compressed; networks not included. */
const CODE_BYTES = 20_000;
const read = (...path) => readFileSync(join(ROOT, ...path));
const run = (cwd, command, ...args) => execFileSync(command, args, { cwd, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });

test('the code is small', (t) => {
  const code = readdirSync(join(ROOT, 'src')).map((file) => read('src', file));
  const size = gzipSync(Buffer.concat(code), { level: 9 }).length;
  t.diagnostic(`${size} bytes of code, compressed`);
  assert.ok(code.length >= 7 && size < CODE_BYTES, `${size} bytes`);
  for (const name of ['fast', 'balanced']) {
    const bytes = ['json', 'bin'].reduce((sum, ending) => sum + gzipSync(read('programs', name, `program.${ending}`), { level: 9 }).length, 0);
    t.diagnostic(`${name}: ${bytes} bytes, compressed`);
  }
  const lines = read('src', 'session.js').toString().split('\n').length;
  assert.ok(lines <= 300, `session.js has ${lines} lines`);
});

test('types: right uses are accepted, wrong ones are errors', () => {
  run(ROOT, 'npx', 'tsc', '-p', '.');
});

test('the commands of the README pack and install a package that works', async (t) => {
  await inFolder((project) => {
    mkdirSync(join(project, 'aonet/engines'), { recursive: true });
    symlinkSync(ROOT, join(project, 'aonet/engines/npm'));
    writeFileSync(join(project, 'package.json'), '{ "private": true, "type": "module" }');
    const [commands] = blocks('sh');
    assert.match(commands, /^npm pack/);
    const said = run(project, 'bash', '-ec', commands);
    t.diagnostic(said.trim().split('\n').at(-1));
    const installed = join(project, 'node_modules/aonet');
    const files = readdirSync(installed, { recursive: true }).sort();
    for (const file of ['README.md', 'LICENSE-MIT', 'LICENSE-APACHE', 'src/three.js', 'types/index.d.ts', 'types/three.d.ts', 'programs/fast/program.bin', 'programs/balanced/program.json']) {
      assert.ok(files.includes(file), `${file} in ${files}`);
    }
    assert.ok(!files.some((file) => /^(tests|example|node_modules|build)/.test(file)), String(files));
    const { version } = JSON.parse(readFileSync(join(installed, 'package.json')));
    assert.equal(version, JSON.parse(read('package.json')).version);
    // In Node, from the installed files.
    writeFileSync(join(project, 'load.js'), `import { AonetError, Program } from 'aonet';
for (const name of ['fast', 'balanced']) console.log((await Program.load(name)).precisions.join());
await Program.load(new URL('file:///nothing/program.json')).catch((error) => console.log(error instanceof AonetError, error.message));`);
    const [fast, balanced, missing] = run(project, 'node', 'load.js').trim().split('\n');
    assert.deepEqual([fast, balanced], ['f16,f32', 'f16,f32']);
    assert.match(missing, /^true aonet: file:\/\/\/nothing\/program.json: expected a file of a program, found ENOENT/);
    // three.js's own modules need a browser's globals; resolving is what is tested.
    assert.match(run(project, 'node', '--input-type=module', '-e', "console.log(import.meta.resolve('aonet/three'))"), /aonet\/src\/three.js/);
  });
});
