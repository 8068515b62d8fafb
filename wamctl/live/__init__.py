"""The running experiment in Foxglove (`wamctl excite --live`)."""
