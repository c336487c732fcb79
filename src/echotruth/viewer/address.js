// Keeps the address of the page in step with what is shown, so that it can be sent to others.
const query = new URLSearchParams(address.data.query[0]);
if (slider.value > 0) query.set("frame", slider.value);
const text = query.toString();
history.replaceState(null, "", text ? `?${text}` : location.pathname);
