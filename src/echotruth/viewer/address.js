// Keeps the address of the page in step with what is shown, so that it can be sent to others.
const query = new URLSearchParams(address.data.query[0]);
if (!button.active) query.set("frame", slider.value); // an address without it plays
const text = query.toString();
history.replaceState(null, "", text ? `?${text}` : location.pathname);
