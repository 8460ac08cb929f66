// What Foxglove and Lichtblick do with a live view, with their own parts: the protocol's reference client
// (@foxglove/ws-protocol, over `ws`), the parser of their schemas (@foxglove/rosmsg) and the reader of their
// messages (@foxglove/rosmsg2-serialization).
//   node foxglove_client.js ws://ADDRESS        with the four packages on NODE_PATH
// When the server closes, prints as JSON how many messages of each topic it decoded. Exit code 1 when
// something is not understood.
const { parse } = require('@foxglove/rosmsg');
const { MessageReader } = require('@foxglove/rosmsg2-serialization');
const { FoxgloveClient } = require('@foxglove/ws-protocol');
const { WebSocket } = require('ws');

const fail = (words) => {
  console.error(`foxglove_client: ${words}`);
  process.exit(1);
};

function connect(url, attempts) {
  const socket = new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
  socket.once('error', (error) => {
    if (error.code !== 'ECONNREFUSED' || attempts === 0) fail(error);
    setTimeout(() => connect(url, attempts - 1), 50);
  });
  socket.once('open', () => watch(socket));
}

function watch(socket) {
  const client = new FoxgloveClient({ ws: socket });
  const readers = new Map();
  const topics = new Map();
  const counts = {};
  let points = 0;
  let info;
  client.on('serverInfo', (event) => (info = event));
  client.on('status', (event) => fail(`status: ${event.message}`));
  client.on('error', fail);
  client.on('advertise', (channels) => {
    for (const channel of channels) {
      const subscription = client.subscribe(channel.id);
      readers.set(subscription, new MessageReader(parse(channel.schema, { ros2: true })));
      topics.set(subscription, channel.topic);
      counts[channel.topic] = 0;
    }
  });
  client.on('message', ({ subscriptionId, data }) => {
    const message = readers.get(subscriptionId).readMessage(data);
    const topic = topics.get(subscriptionId);
    counts[topic] += 1;
    if (topic === '/points') points += message.width;
  });
  client.on('close', () => console.log(JSON.stringify({ name: info.name, points, counts })));
}

connect(process.argv[2], 200);
