// Caches the page and its files. If the bridge cannot be reached, the page still opens, and says so.
// All other requests bypass this script, so data is never cached and never old. It also shows the
// notifications that the bridge pushes while the page is closed.
const SCOPE = self.registration.scope;
const CACHE = `lupin-shell ${SCOPE}`;

self.addEventListener('fetch', (event) => {
  const { request } = event;
  const address = request.url.split(/[?#]/)[0];
  if (request.method !== 'GET') return;
  if (request.mode === 'navigate' && address === SCOPE) event.respondWith(page(request));
  else if (address.startsWith(`${SCOPE}assets/`)) event.respondWith(file(request));
});

// The bridge's current page; the cached copy only if there is no answer at all.
async function page(request) {
  let response;
  try {
    response = await fetch(request);
  } catch (error) {
    const kept = await (await caches.open(CACHE)).match(SCOPE);
    if (kept) return kept;
    throw error;
  }
  if (response.ok && !response.redirected) await keep(response.clone()).catch(isFull);
  return response;
}

// A changed page has other files: the files of the previous one are deleted.
async function keep(response) {
  const known = await (await caches.open(CACHE)).match(SCOPE);
  if (known && known.headers.get('etag') === response.headers.get('etag')) return;
  await caches.delete(CACHE);
  await (await caches.open(CACHE)).put(SCOPE, response);
}

// A file's name changes with its content, so a cached copy is never old.
async function file(request) {
  const cache = await caches.open(CACHE);
  const kept = await cache.match(request);
  if (kept) return kept;
  const response = await fetch(request);
  if (response.ok) await cache.put(request, response.clone()).catch(isFull);
  return response;
}

// No room for a copy: the page still opens while the bridge answers.
const isFull = () => undefined;

self.addEventListener('push', (event) => {
  const { title, body } = event.data.json();
  event.waitUntil(
    self.registration.showNotification(title, { body, tag: 'lupin-twin.alarms', renotify: true }),
  );
});

self.addEventListener('notificationclick', (event) => {
  event.notification.close();
  event.waitUntil(show());
});

async function show() {
  const pages = await self.clients.matchAll({ type: 'window' });
  await (pages.length > 0 ? pages[0].focus() : self.clients.openWindow(SCOPE));
}
