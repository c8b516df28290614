// Makes side_by_side.png: the example's pictures in a headless Chromium. Usage: node example/picture.mjs [WxH]
import { writeFileSync } from 'node:fs';
import { visit } from '../tests/support/chromium.mjs';

const size = process.argv[2] ?? '352x198';
const { png, error } = await visit(`example/picture.html?still&size=${size}`);
if (error) throw new Error(error);
const path = new URL('side_by_side.png', import.meta.url);
writeFileSync(path, Buffer.from(png.split(',')[1], 'base64'));
console.log(path.pathname);
process.exit(0);
