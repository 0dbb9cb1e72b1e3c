// The page itself and its files, for when the bridge cannot be reached: the page then opens and says
// so. Everything else goes past this script, so data is never kept and never old. It also shows the
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

// As the bridge has it now; the copy only where there is no answer at all.
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

// Another page has other files: what the one before had goes.
async function keep(response) {
  const known = await (await caches.open(CACHE)).match(SCOPE);
  if (known && known.headers.get('etag') === response.headers.get('etag')) return;
  await caches.delete(CACHE);
  await (await caches.open(CACHE)).put(SCOPE, response);
}

// Its name changes with what is in it, so a copy is never an old one.
async function file(request) {
  const cache = await caches.open(CACHE);
  const kept = await cache.match(request);
  if (kept) return kept;
  const response = await fetch(request);
  if (response.ok) await cache.put(request, response.clone()).catch(isFull);
  return response;
}

// There is no room for a copy: the page opens as long as there is an answer.
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
