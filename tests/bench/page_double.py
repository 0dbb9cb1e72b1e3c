"""A bridge inside the page: WebSocket and fetch that a clock drives, for eight hours in minutes.

A network would be the slowest part, and a queue of its frames would be counted as the page's.
"""

from typing import Final

# What the page's clock runs in one go.
STEP_S: Final = 60

# 29 tags; ten frames a second, of which every tenth brings an observation, as deltas. Now and
# then a pest, a new species, a broken sensor, and every quarter of an hour a lost connection.
NETWORK: Final = """
window.network = { frames: 0, fetches: 0 };
(() => {
  const start = Math.floor(Date.now() / 1000);
  let seq = 0;
  let observations = 0;
  const time = () => {
    const ms = Math.round(performance.now());
    return { sec: start + Math.floor(ms / 1000), nanosec: (ms % 1000) * 1e6 };
  };
  const header = () => ({ stamp: time(), frame_id: 'map' });
  const tag = (index) => {
    const x = 0.5 + (index % 6), y = 0.5 + Math.floor(index / 6);
    const n = observations;
    return {
      tag_id: String(index + 1),
      pose: { position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
      readings: [
        { name: 'temperature', value: n % 97 === 0 ? null : 20 + 8 * Math.sin(n / 50 + index),
          observed_at: time() },
        { name: 'humidity', value: 60 + 10 * Math.cos(n / 70 + index),
          observed_at: time() },
      ],
      last_observed: time(),
      stale_seconds: 0,
      species: n % 500 === 0 ? `species ${n}` : ['lupin', 'tomato', 'basil'][index % 3],
      species_confidence: 0.9,
      anomaly: n % 60 < 5,
      flower_count: 4,
      bug_count: n % 60 < 5 ? 2 : 0,
      flowers: [0, 1, 2, 3].map((i) => ({
        position: { x: x + i / 10, y: y + 0.1, z: 0.4 }, height_m: 0.4, species: 'lupin',
        confidence: 0.9, anomaly: false,
      })),
      box_footprint: { points: [[0, 0], [0.4, 0], [0.4, 0.2], [0, 0.2]].map(
        ([dx, dy]) => ({ x: x + dx, y: y + dy, z: 0 })) },
      looked_at: time(), last_try: time(), last_try_status: 0, last_try_detail: '',
    };
  };
  const reason = (tag) => ({
    kind: 'pest', verdict: 'critical', sensor: '', value: tag.bug_count, limit: null, since: null,
  });
  // As the bridge judges: what changed, and the house.
  const health = (of) => ({
    house: {
      verdict: tags.some((tag) => tag.anomaly) ? 'critical' : 'healthy', reasons: [],
      day: { is_day: true, source: 'clock' },
      patrol: { interval_s: 29, last_scan: time(), overdue: 0 },
    },
    tags: Object.fromEntries(of.map((tag) => [tag.tag_id, {
      verdict: tag.anomaly ? 'critical' : 'healthy', reasons: tag.anomaly ? [reason(tag)] : [],
    }])),
  });
  const alarms = () => ({
    type: 'alarms', source: 'journal', since: { sec: start, nanosec: 0 }, notes: 0,
    alarms: tags.filter((tag) => tag.anomaly).map((tag) => ({
      id: `${tag.tag_id} pest`, reason: reason(tag), tag_id: tag.tag_id,
      raised_at: tag.looked_at, cleared_at: null, worst: null,
    })),
  });
  const tags = Array.from({ length: 29 }, (_, index) => tag(index));
  const revision = () => `r${observations}`;

  class Socket {
    constructor() {
      this.age = 0;
      setTimeout(() => {
        this.onopen?.();
        this.say({ type: 'status', twin: 'live', reason: 'live', message: '',
                   state_age_seconds: 0, has_map: true, origin: 'robot',
                   twin_count: 1,
                   input_problems: [], day_length_s: 86400, drops: [], outward: [],
                   journal: { state: 'recording', detail: 'recording', set_aside: '',
                              simulated: null } });
        this.say({ type: 'state', seq: ++seq, revision: revision(),
                   state: { header: header(), tags }, health: health(tags) });
        this.say(alarms());
        this.timer = setInterval(() => this.beat(), 100);
      }, 1);
    }
    say(frame) {
      network.frames += 1;
      this.onmessage?.({ data: JSON.stringify(frame) });
    }
    beat() {
      if (++this.age > 9000) {
        this.close();
        this.onclose?.({ code: 1006 });
        return;
      }
      const changed = [];
      if (this.age % 10 === 0) {
        const index = ++observations % tags.length;
        tags[index] = tag(index);
        changed.push(tags[index]);
      }
      const base = seq++;
      this.say({ type: 'delta', seq, base, revision: revision(), header: header(),
                 changed, removed: [], health: health(changed) });
      if (changed.length > 0) this.say(alarms());
    }
    close() {
      clearInterval(this.timer);
    }
  }
  window.WebSocket = Socket;

  const npy = () => {
    const width = 180, height = 160;
    const text = `{'descr': '<f4', 'fortran_order': False, 'shape': (${height}, ${width}), }`;
    const head = text.padEnd(117) + '\\n';
    const bytes = new Uint8Array(10 + head.length + 4 * width * height);
    bytes.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, head.length, 0]);
    bytes.set(new TextEncoder().encode(head), 10);
    const values = new DataView(bytes.buffer, 10 + head.length);
    for (let i = 0; i < width * height; i++) {
      const value = i % 7 === 0 ? NaN : 20 + 8 * Math.sin((i + observations) / 900);
      values.setFloat32(4 * i, value, true);
    }
    return bytes;
  };
  const fieldHeaders = {
    'X-Field-Width': '180', 'X-Field-Height': '160', 'X-Field-Origin-X': '-1',
    'X-Field-Origin-Y': '-1', 'X-Field-Resolution': '0.05', 'X-Field-Value-Min': '12',
    'X-Field-Value-Max': '28', 'X-Field-Sample-Count': '29',
  };
  let picture = null;
  const mapPicture = () => picture ??= new Promise((resolve) => {
    const canvas = document.createElement('canvas');
    canvas.width = 160;
    canvas.height = 140;
    const context = canvas.getContext('2d');
    context.fillStyle = 'rgb(236 236 236)';
    context.fillRect(10, 10, 140, 120);
    canvas.toBlob(resolve);
  });
  const real = window.fetch.bind(window);
  window.fetch = async (url, options) => {
    network.fetches += 1;
    const { pathname } = new URL(url);
    if (pathname.endsWith('/api/sensors')) return real(url, options);
    if (pathname.endsWith('field.npy')) return new Response(npy(), { headers: fieldHeaders });
    if (pathname.endsWith('map.png')) return new Response(await mapPicture());
    if (pathname.endsWith('/api/map')) return Response.json({
      header: header(),
      info: { map_load_time: { sec: 0, nanosec: 0 }, resolution: 0.05, width: 160, height: 140,
              origin: { position: { x: -1, y: -1, z: 0 },
                        orientation: { x: 0, y: 0, z: 0, w: 1 } } },
    });
    if (pathname.endsWith('/quality')) return Response.json({
      sensor_type: 'temperature', unit: '°C', sample_count: 29, judged_count: 29,
      rmse: 1 + (observations % 10) / 10, worst: null, painted_share: 0.9, far_off_tags: [],
    });
    return Response.json({ detail: 'not in this double' }, { status: 404 });
  };
})();
"""
