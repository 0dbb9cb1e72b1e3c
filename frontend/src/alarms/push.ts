/** Notifications by a push service, for a page that is closed; where the bridge offers them. */
import { route } from '../contract/api';

interface Key {
  public_key: string | null;
}

/** Subscribes this browser at the bridge, or ends that. Harmless where there is no Web Push. */
export async function wishPush(isWished: boolean): Promise<void> {
  if (!('serviceWorker' in navigator)) return;
  const registration = await navigator.serviceWorker.getRegistration();
  if (!registration || !('pushManager' in registration)) return;
  const { pushManager } = registration;
  const known = await pushManager.getSubscription();
  if (!isWished) {
    if (!known) return;
    await post({ endpoint: known.endpoint });
    await known.unsubscribe();
    return;
  }
  const answer = await fetch(route('api/push'));
  if (!answer.ok) return;
  const { public_key: key } = (await answer.json()) as Key;
  if (key === null) return;
  const options = { userVisibleOnly: true, applicationServerKey: key };
  let subscription;
  try {
    subscription = await pushManager.subscribe(options);
  } catch (error) {
    // One with another key, of a bridge that was here before.
    if (!known) throw error;
    await known.unsubscribe();
    subscription = await pushManager.subscribe(options);
  }
  await post(subscription.toJSON());
}

async function post(body: PushSubscriptionJSON): Promise<void> {
  const answer = await fetch(route('api/push'), {
    method: 'POST',
    headers: { 'Content-Type': 'application/json', 'X-Lupin-Twin': '1' },
    body: JSON.stringify(body),
  });
  if (!answer.ok) throw new Error(`/api/push: ${answer.status}`);
}
