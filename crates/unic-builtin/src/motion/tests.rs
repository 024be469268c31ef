//! Motions hold on every body: a T-posed figure made here, and the real body where its file is there.

mod contact;
mod figure;
mod rhythm;
mod smooth;
mod vocabulary;
