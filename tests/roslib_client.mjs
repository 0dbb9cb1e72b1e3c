// What a page with roslib does, told as one line of JSON: `node roslib_client.mjs URL SCENARIO`.
// roslib is used as it comes from npm; nothing here knows that the other side is no rosbridge.

import { Ros, Service, Topic } from 'roslib';

const [url, scenario] = process.argv.slice(2);
const STATE = { name: '/twin/state', messageType: 'lupin_msgs/msg/TwinState' };
const FIELD = { name: '/twin/get_field', serviceType: 'lupin_msgs/srv/GetField' };
const BOX = { bbox_min_x: -3, bbox_min_y: -3, bbox_max_x: 3, bbox_max_y: 3 };

const ros = new Ros();
const statuses = [];
const handleMessage = ros.handleMessage.bind(ros);
ros.handleMessage = (message) => {
  // roslib has an event for each id, and none for all.
  if (message.op === 'status') statuses.push(message);
  handleMessage(message);
};
ros.on('error', () => {}); // a refused connection: "close" follows

const once = (emitter, event) => new Promise((resolve) => emitter.once(event, resolve));
const asked = (method, ...args) =>
  new Promise((resolve, reject) => ros[method](...args, resolve, reject));

function call(request, timeout) {
  const service = new Service({ ros, ...FIELD });
  return new Promise((resolve) => {
    const done = (callback) => (values) => resolve({ callback, values });
    service.callService(request, done('done'), done('failed'), timeout);
  });
}

async function connect() {
  const connected = once(ros, 'connection');
  await ros.connect(url);
  await connected;
}

function subscribe(options = {}) {
  const topic = new Topic({ ros, ...STATE, ...options });
  const messages = [];
  topic.subscribe((message) => messages.push(message));
  return { topic, messages, next: () => once(topic, 'message') };
}

/** Resolves when all that was sent so far has been answered. */
const settled = () => asked('getTopics');

const scenarios = {
  /** Subscribes, and tells the first state. */
  async latch() {
    return { state: await subscribe().next() };
  },

  /** Asks for fields, good ones and bad ones. */
  async field() {
    return {
      known: await call({ sensor_type: 'temperature', resolution: 0.5, ...BOX }),
      refused: await call({ sensor_type: 'temperature' }),
      failed: await call({ sensor_type: 'temperature', colour: 'red' }),
      // Another field than the known one, which is kept and there at once.
      late: await call({ sensor_type: 'temperature', resolution: 0.01, ...BOX }, 1e-9),
    };
  },

  /** Looks around, as tools do. */
  async names() {
    return {
      topics: await asked('getTopics'),
      nodes: await asked('getNodes').catch((reason) => ({ failed: reason })),
    };
  },

  /** Draws the map and follows the inputs, and asks for the map in forms that are not served. */
  async inputs() {
    const MAP = { name: '/map', messageType: 'nav_msgs/msg/OccupancyGrid' };
    const next = (name, messageType) => subscribe({ name, messageType }).next();
    const [map, observation, tags] = await Promise.all([
      next(MAP.name, MAP.messageType),
      next('/floranova/observations', 'lupin_msgs/msg/Observation'),
      next('/perception/discovered_tags', 'lupin_msgs/msg/DiscoveredTags'),
    ]);
    const compressed = {};
    for (const compression of ['cbor', 'cbor-raw', 'png']) {
      const again = await subscribe({ ...MAP, compression }).next();
      compressed[compression] = again.header.frame_id;
    }
    return { map, observation, tags, compressed, statuses };
  },

  /** Tries whatever would change something. */
  async write() {
    const topic = new Topic({ ros, name: '/cmd_vel', messageType: 'geometry_msgs/msg/Twist' });
    topic.publish({ linear: { x: 1 } });
    topic.unadvertise();
    const service = new Service({ ros, name: '/reset', serviceType: 'std_srvs/srv/Trigger' });
    await service.advertise(() => true);
    ros.authenticate('mac', 'client', 'dest', 'rand', 0, 'admin', 0);
    await settled();
    const told = statuses.splice(0);
    return { told };
  },

  /** Two components of a page on one topic, of which one stops listening. */
  async two() {
    const first = subscribe({ throttle_rate: 3_600_000, queue_length: 10 });
    await first.next();
    const latchedForSecond = once(ros, STATE.name);
    const second = subscribe();
    await latchedForSecond;
    first.topic.unsubscribe();
    const heard = first.messages.length;
    await second.next();
    second.topic.unsubscribe();
    await settled();
    const afterTheEnd = [];
    ros.on(STATE.name, (message) => afterTheEnd.push(message));
    // `latch` on a second connection: a state has been made since, and was not sent here.
    const other = new Ros();
    await other.connect(url);
    const watched = new Topic({ ros: other, ...STATE });
    let states = 0;
    await new Promise((resolve) => watched.subscribe(() => ++states === 3 && resolve()));
    other.close();
    await settled();
    return {
      statuses,
      heardAfterUnsubscribe: first.messages.length - heard,
      afterTheEnd: afterTheEnd.length,
    };
  },

  /** Keeps its subscription while the bridge is gone for a while. */
  async reconnect() {
    const { topic, next } = subscribe();
    const before = await next();
    const closed = once(ros, 'close');
    console.log('subscribed');
    await closed;
    const again = new Promise((resolve) => topic.once('message', resolve));
    ros.on('close', () => setTimeout(() => ros.connect(url), 50));
    await ros.connect(url);
    return { before, after: await again };
  },
};

await connect();
const told = await scenarios[scenario]();
console.log(JSON.stringify(told));
process.exit(0); // roslib's own timers and sockets would keep it alive
