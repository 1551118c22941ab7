//! Where the stories find the real models, when they are there.
