// A bridge inside the page for a greenhouse of any size, whose frames are sent by hand.
// COUNT tags in a square, a metre apart, each with two readings, species and two blooms.
// `greenhouse.beat()`: a frame that changes nothing; `greenhouse.change(n)`: n tags scanned again;
// `greenhouse.idle()`: only the connection lives; `greenhouse.unpin(id)`: a tag without a pose.
window.greenhouse = {};
(() => {
  const start = Math.floor(Date.now() / 1000);
  const columns = Math.ceil(Math.sqrt(COUNT));
  let seq = 0, revision = 1, next = 0;
  const time = () => {
    const ms = Math.round(performance.now());
    return { sec: start + Math.floor(ms / 1000), nanosec: (ms % 1000) * 1e6 };
  };
  const header = () => ({ stamp: time(), frame_id: 'map' });
  const tag = (index, temperature) => {
    const x = index % columns, y = Math.floor(index / columns);
    const observed_at = time();
    const readings = [['temperature', temperature], ['humidity', 60 + index % 9]];
    return {
      tag_id: String(index + 1),
      pose: { position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
      readings: readings.map(([name, value]) => ({ name, value })),
      last_observed: observed_at, stale_seconds: 0,
      looked_at: observed_at, last_try: observed_at, last_try_status: 0, last_try_detail: '',
      species: ['lupin', 'tomato', 'basil'][index % 3], species_confidence: 0.9,
      anomaly: index % 50 === 0, flower_count: 2, bug_count: 0,
      flowers: [0, 1].map((i) => ({ position: { x: x + i / 10, y: y + 0.1, z: 0.4 },
        height_m: 0.4, species: 'lupin', confidence: 0.9, anomaly: false })),
      box_footprint: { points: [] },
    };
  };
  const tags = Array.from({ length: COUNT }, (_, index) => tag(index, 18 + index % 12));
  const status = { type: 'status', twin: 'live', reason: 'live', message: '',
                   state_age_seconds: 0, has_map: false, origin: 'robot', drops: [],
                   twin_count: 1,
                   input_problems: [], day_length_s: 86400,
                   journal: { state: "recording", detail: "", set_aside: "", simulated: null },
                   outward: [] };
  const health = { house: { verdict: 'healthy', reasons: [],
                            day: { is_day: true, source: 'assumed' },
                            patrol: { interval_s: null, last_scan: null, overdue: 0 } },
                   tags: {} };
  let socket;
  const say = (frame) => socket.onmessage?.({ data: JSON.stringify(frame) });
  const delta = (changed) => {
    const base = seq++;
    say({ type: 'delta', seq, base, revision: `r${revision}`, header: header(), changed,
          removed: [], health });
  };
  window.greenhouse.beat = () => delta([]);
  window.greenhouse.change = (count) => {
    revision += 1;
    const changed = Array.from({ length: count }, () => {
      const index = (next += 7919) % COUNT;
      return tags[index] = tag(index, 18 + (revision + index) % 12);
    });
    delta([...new Map(changed.map((each) => [each.tag_id, each])).values()]);
  };
  window.greenhouse.unpin = (id) => {
    const { position, orientation } = tags[id - 1].pose;
    const pose = { position, orientation: { ...orientation, w: 0 } };
    tags[id - 1] = { ...tags[id - 1], pose };
    revision += 1;
    delta([tags[id - 1]]);
  };
  window.greenhouse.idle = () => say(status);
  window.WebSocket = class {
    constructor() {
      socket = this;
      setTimeout(() => {
        this.onopen?.();
        say(status);
        say({ type: 'state', seq: ++seq, revision: `r${revision}`,
              state: { header: header(), tags }, health });
      }, 1);
    }
    close() {}
  };
  const real = window.fetch.bind(window);
  window.fetch = async (url, options) => new URL(url).pathname.endsWith('/api/sensors')
    ? real(url, options)
    : Response.json({ detail: 'not in this double' }, { status: 404 });
})();
