using System.Collections.Generic;
using System.Globalization;

namespace Unic.Editor
{
    /// <summary>Comparison of a garment's rig with its model, line by line.</summary>
    public sealed class RigReport
    {
        /// <summary>One line for each joint, with its bone or none.</summary>
        public readonly List<string> joints = new List<string>();

        /// <summary>Lines about the whole rig.</summary>
        public readonly List<string> summary = new List<string>();

        /// <summary>The sentence that the garment would refuse the rig with; null if it fits.</summary>
        public string Problem { get; private set; }

        /// <summary>Compares the rig of a garment with its model.</summary>
        public static RigReport Of(UnicGarment garment)
        {
            RigReport report = new RigReport();
            if (garment.model == null)
            {
                report.Problem = garment.name + ": expected a model, found none";
                return report;
            }
            try
            {
                report.Compare(garment);
            }
            catch (UnicException error)
            {
                report.Problem = error.Message;
            }
            return report;
        }

        private void Compare(UnicGarment garment)
        {
            LoadedModel model = garment.model.Acquire();
            try
            {
                Compare(garment, model);
            }
            finally
            {
                garment.model.Release();
            }
        }

        private void Compare(UnicGarment garment, LoadedModel model)
        {
            RigMatch match = garment.Match(model);
            for (int joint = 0; joint < match.bones.Length; joint++)
                joints.Add(model.jointNames[joint] + ": "
                           + (match.bones[joint] == null ? "none" : match.bones[joint].name));
            summary.Add(match.Found + " of " + match.bones.Length + " joints have a bone");
            if (match.Found == 0)
            {
                match.Require(garment.missingJoints);
                return;
            }
            string worst;
            RestFit fit = match.Fit(out worst);
            summary.Add("largest distance at rest: " + Number(1e3f * fit.error) + " mm, joint " + worst);
            UnicRig rig = new UnicRig(model, match, garment.missingJoints, garment.mostRestError);
            summary.Add("size of the character: " + Number(rig.scale) + " of the model's");
        }

        private static string Number(float value)
        {
            return value.ToString("0.00", CultureInfo.InvariantCulture);
        }
    }
}
