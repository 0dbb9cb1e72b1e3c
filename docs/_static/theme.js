// Before the page is painted. Furo has this inline, which the bridge's content security policy forbids.
document.body.dataset.theme = localStorage.getItem('theme') || 'auto';
