//! Tips and places that are known, found again; and what the stated uncertainty is worth.

mod dice;
mod pivots;
mod registrations;
