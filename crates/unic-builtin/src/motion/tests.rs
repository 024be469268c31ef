//! Motions hold on every body: a T-posed figure made here, the built-in human, and a body in an A-pose
//! where its file is there.

mod contact;
mod figure;
mod rhythm;
mod smooth;
mod vocabulary;
