// What Foxglove does, told as one line of JSON: `node foxglove_client.mjs URL SCENARIO [TOPIC...]`.
// The client is Foxglove's own, from npm; nothing here knows whom it talks to.

import protocol from '@foxglove/ws-protocol';
import WebSocket from 'ws';

const { FoxgloveClient } = protocol;

const [url, scenario, ...topics] = process.argv.slice(2);

const statuses = [];
const errors = [];
const channels = new Map();

/** A client that is connected, once it has been told who serves and what. */
async function connect(subprotocol = FoxgloveClient.SUPPORTED_SUBPROTOCOL) {
  const ws = new WebSocket(url, [subprotocol]);
  const client = new FoxgloveClient({ ws });
  client.on('status', ({ level, message }) => statuses.push({ level, message }));
  client.on('error', (error) => errors.push(String(error)));
  client.on('unadvertise', (ids) => ids.forEach((id) => channels.delete(id)));
  const info = new Promise((resolve) => client.on('serverInfo', resolve));
  const advertised = new Promise((resolve) =>
    client.on('advertise', (added) => {
      for (const channel of added) channels.set(channel.id, channel);
      resolve();
    }),
  );
  await Promise.all([info, advertised]);
  return { client, ws, info: await info };
}

const channelOf = (topic) => [...channels.values()].find((channel) => channel.topic === topic);

function base64({ buffer, byteOffset, byteLength }) {
  return Buffer.from(buffer, byteOffset, byteLength).toString('base64');
}

/** Resolves with the first `count` messages of a subscription. */
function messagesOf(client, subscription, count) {
  const found = [];
  return new Promise((resolve) =>
    client.on('message', ({ subscriptionId, timestamp, data }) => {
      if (subscriptionId !== subscription) return;
      found.push({ timestamp: String(timestamp), data: base64(data) });
      if (found.length === count) resolve(found);
    }),
  );
}

const until = async (look) => {
  for (;;) {
    const found = look();
    if (found) return found;
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
};

const scenarios = {
  /** Connects in both ways that there are, and takes the first message of each topic. */
  async look() {
    const { client, ws, info } = await connect();
    const first = {};
    for (const topic of topics) {
      const channel = await until(() => channelOf(topic));
      const [message] = await messagesOf(client, client.subscribe(channel.id), 1);
      first[topic] = message;
    }
    const chosen = [ws.protocol, (await connect('foxglove.sdk.v1')).ws.protocol];
    return { info, chosen, channels: [...channels.values()], first };
  },

  /** Unsubscribes, and hears nothing from then on; subscribes anew, and hears the last again. */
  async again() {
    const { client } = await connect();
    const { id } = channelOf(topics[0]);
    const first = client.subscribe(id);
    const [before] = await messagesOf(client, first, 1);
    client.unsubscribe(first);
    let late = 0;
    const second = client.subscribe(id);
    client.on('message', ({ subscriptionId }) => (late += subscriptionId === first));
    const [after] = await messagesOf(client, second, 1);
    return { before, after, late };
  },

  /** Tries whatever would change something, and whatever is not there. */
  async write() {
    const { client } = await connect();
    const id = client.advertise({ topic: '/cmd_vel', encoding: 'cdr', schemaName: 'a/msg/B' });
    client.sendMessage(id, new Uint8Array(4));
    client.unadvertise(id);
    client.getParameters([], 'x');
    client.setParameters([{ name: 'idw_power', value: 9 }], 'x');
    client.subscribeParameterUpdates([]);
    client.unsubscribeParameterUpdates([]);
    client.sendServiceCallRequest({
      serviceId: 1,
      callId: 1,
      encoding: 'cdr',
      data: new DataView(new ArrayBuffer(4)),
    });
    client.subscribeConnectionGraph();
    client.unsubscribeConnectionGraph();
    client.fetchAsset('file:///etc/passwd', 1);
    client.subscribe(4_000_000);
    await until(() => statuses.length >= 12);
    return {};
  },
};

const told = await scenarios[scenario]();
console.log(JSON.stringify({ ...told, statuses, errors }));
process.exit(0);
