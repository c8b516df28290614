/** An error of this package: it names the thing, what was expected and what was found. */
export class AonetError extends Error {
  name = 'AonetError';
}

/** @returns {AonetError} */
export const wrong = (what, expected, found) => new AonetError(`aonet: ${what}: expected ${expected}, found ${found}`);

/** Throws unless `ok`. */
export function check(ok, what, expected, found) {
  if (!ok) throw wrong(what, expected, found);
}
