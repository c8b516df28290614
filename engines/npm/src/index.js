export { AonetError } from './errors.js';
export { Program } from './program.js';
export { Session } from './session.js';
export { HalfSession } from './half.js';
