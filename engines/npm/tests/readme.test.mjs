// The README's code does what the README says.
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { visit } from './support/chromium.mjs';
import { blocks } from './support/readme.mjs';

let report;
before(async () => {
  report = await visit('tests/readme.html', { answer: (name) => (name === 'blocks' ? JSON.stringify(blocks('js')) : '') });
  assert.equal(report.error, undefined);
  assert.equal(report.count, 3, 'every block is run');
}, { timeout: 3_600_000 });

test('the first picture', (t) => {
  const { lit, none } = report.first;
  t.diagnostic(JSON.stringify(report.first));
  assert.ok(none > 30 && lit < none - 1 && lit > 0.5 * none, 'a lit scene that ambient occlusion darkens');
});

test('in the place of GTAONode', (t) => {
  t.diagnostic(`${report.inPlace}`);
  assert.ok(report.inPlace < report.first.none - 1 && report.inPlace > 0.5 * report.first.none);
});

test('a session on any device', (t) => {
  const { found: [flat, stepped], complaints } = report.session;
  assert.deepEqual(complaints, []);
  assert.equal(flat.format, 'r16float');
  const [open, corner] = [flat, stepped].map(({ middleRow }) => middleRow[middleRow.length / 2 - 2]);
  t.diagnostic(`wall ${open}, beside a step ${corner}`);
  assert.ok(open > 0.9 && corner < open - 0.1, 'a wall is open, its corner is not');
});
