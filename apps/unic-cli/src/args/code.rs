//! Options about the model's motion code, for every command that runs a model.

use unic_core::CodeSampling;

/// Choice of the categories of the motion code, with or without noise.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct CodeArgs {
    /// Scale, from 0 to 1, of the Gumbel noise with which the model's encoder chooses the
    /// categories of its motion code [default: no noise, the category with the largest logit].
    #[arg(long, value_name = "SCALE", value_parser = scale)]
    pub(crate) gumbel: Option<f32>,
    /// Seed of the noise of --gumbel.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "gumbel")]
    gumbel_seed: u64,
}

impl CodeArgs {
    /// Returns the choice of categories that the options ask for.
    pub(crate) fn sampling(self) -> CodeSampling {
        let seed = self.gumbel_seed;
        self.gumbel
            .map_or(CodeSampling::Largest, |scale| CodeSampling::Gumbel {
                scale,
                seed,
            })
    }
}

fn scale(text: &str) -> Result<f32, String> {
    let scale: Option<f32> = text.parse().ok().filter(|s| (0.0..=1.0).contains(s));
    scale.ok_or_else(|| "expected a number from 0 to 1".to_owned())
}
