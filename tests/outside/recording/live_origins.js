// Which web pages a live view lets in, asked by a real browser.
//   node live_origins.js PORT FRIENDS_PORT       with playwright-core on NODE_PATH, and Chromium
// PORT serves a live view; so does FRIENDS_PORT, with `--allow-origin http://friend.example:PAGES`, where
// PAGES is what this program prints in its first line. It then waits for a line on stdin, opens its pages
// under several names, and lets each ask for the view. Exit code 1 when a stranger gets in or a friend does
// not.
const fs = require('fs');
const http = require('http');
const os = require('os');
const path = require('path');
const readline = require('readline');
const { chromium } = require('playwright-core');

const ARGUMENTS = [
  '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
  '--disable-background-networking', '--disable-component-update', '--disable-sync',
  // Every made-up name is this machine: also what a stranger's name service may say.
  '--host-resolver-rules=MAP *.example 127.0.0.1',
];
const [port, friendsPort] = process.argv.slice(2);

/** Whether a page's script can open the view at a URL. */
const canWatch = (frame, url) => frame.evaluate((address) => new Promise((done) => {
  const socket = new WebSocket(address, 'foxglove.sdk.v1');
  socket.onmessage = () => { done(true); socket.close(); };
  socket.onerror = () => done(false);
}), url);

async function inFrame(page, address) {
  await page.evaluate(() => {
    const frame = document.createElement('iframe');
    frame.sandbox = 'allow-scripts';
    frame.srcdoc = 'a page in a frame';
    document.body.append(frame);
  });
  await page.waitForTimeout(300);
  return canWatch(page.frames()[1], address);
}

async function ask(page, pages) {
  const file = path.join(os.tmpdir(), `biplane-page-${process.pid}.html`);
  fs.writeFileSync(file, 'a file');
  const table = [
    ['a stranger', `http://stranger.example:${pages}`, `ws://localhost:${port}`, false],
    ['a stranger, by address', `http://stranger.example:${pages}`, `ws://127.0.0.1:${port}`, false],
    ['a stranger whose name means this machine', `http://stranger.example:${pages}`,
      `ws://stranger.example:${port}`, false],
    ['a friend that nobody named', `http://friend.example:${pages}`, `ws://localhost:${port}`, false],
    ['a friend', `http://friend.example:${pages}`, `ws://localhost:${friendsPort}`, true],
    ['a stranger, at the friend\'s', `http://stranger.example:${pages}`,
      `ws://localhost:${friendsPort}`, false],
    ['this machine', `http://localhost:${pages}`, `ws://localhost:${port}`, true],
    // It calls itself `null`, as a page in a sandboxed frame does: it may be anybody's.
    ['a file', `file://${file}`, `ws://localhost:${port}`, false],
  ];
  const wrong = [];
  for (const [who, from, address, expected] of table) {
    await page.goto(from);
    if (await canWatch(page, address) !== expected) wrong.push(`${who}: expected ${expected}`);
  }
  await page.goto(`http://localhost:${pages}`);
  const isFramed = await inFrame(page, `ws://localhost:${port}`);
  if (isFramed) wrong.push('a page in a sandboxed frame: expected false');
  fs.rmSync(file);
  return { wrong, asked: table.length + 1 };
}

const server = http.createServer((_, answer) => answer.end('<!DOCTYPE html><title>a page</title>'));
server.listen(0, '127.0.0.1', () => {
  const pages = server.address().port;
  console.log(pages);
  readline.createInterface({ input: process.stdin }).once('line', async () => {
    const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'biplane-origins-'));
    const options = { executablePath: '/usr/bin/chromium', headless: true, args: ARGUMENTS };
    const context = await chromium.launchPersistentContext(profile, options);
    const { wrong, asked } = await ask(await context.newPage(), pages);
    await context.close();
    fs.rmSync(profile, { recursive: true, force: true });
    wrong.forEach((words) => console.error(`FAILED: ${words}`));
    console.log(`${asked - wrong.length} of ${asked} pages got the answer that is due`);
    process.exit(wrong.length ? 1 : 0);
  });
});
