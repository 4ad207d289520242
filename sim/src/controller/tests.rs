//! The controller without sockets, and with them.
