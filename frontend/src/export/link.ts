/** Copies the address of this view; true when the clipboard took it. */
export async function copyLink(): Promise<boolean> {
  // Only secure contexts have a clipboard, and a greenhouse's plain http is none: hence the
  // look at a property whose type claims that it is always there.
  const clipboard = navigator.clipboard as Clipboard | undefined;
  if (!clipboard) return false;
  return clipboard.writeText(window.location.href).then(
    () => true,
    () => false,
  );
}
