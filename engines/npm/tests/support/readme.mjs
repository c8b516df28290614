// Code of the README.
import { readFileSync } from 'node:fs';

/** The blocks of a language, in their order. */
export function blocks(language) {
  const text = readFileSync(new URL('../../README.md', import.meta.url), 'utf8');
  return Array.from(text.matchAll(/^```(\w*)\n([^]*?)^```$/gm)).filter(([, of]) => of === language).map(([, , code]) => code);
}
