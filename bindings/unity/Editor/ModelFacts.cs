using System.Collections.Generic;
using System.Globalization;

namespace Unic.Editor
{
    /// <summary>Facts of a model in pairs of name and value, for inspectors.</summary>
    public static class ModelFacts
    {
        /// <summary>Reads the facts. One that cannot be read is the sentence that says why.</summary>
        public static List<KeyValuePair<string, string>> Of(UnicModel model)
        {
            List<KeyValuePair<string, string>> facts = new List<KeyValuePair<string, string>>();
            try
            {
                AddNative(model, facts);
                AddFile(model, facts);
            }
            catch (UnicException error)
            {
                Add(facts, "Problem", error.Message);
            }
            return facts;
        }

        private static void AddNative(UnicModel model, List<KeyValuePair<string, string>> facts)
        {
            LoadedModel loaded = model.Acquire();
            try
            {
                Add(facts, "Vertices", loaded.VertexCount.ToString());
                Add(facts, "Triangles", loaded.FaceCount.ToString());
                Add(facts, "Body vertices", loaded.BodyVertexCount.ToString());
                Add(facts, "Joints", loaded.JointCount.ToString());
                Add(facts, "Joint names", string.Join(", ", loaded.jointNames));
                Add(facts, "Ticks a second", Number(loaded.Fps, "0.###"));
                Add(facts, "Native library", UnicLibrary.Version);
            }
            finally
            {
                model.Release();
            }
        }

        private static void AddFile(UnicModel model, List<KeyValuePair<string, string>> facts)
        {
            UnicModelFile file = new UnicModelFile(model.Bytes);
            Add(facts, "Size", Number(model.Size / 1e6, "0.0") + " MB");
            Add(facts, "Capture", file.Name);
            Add(facts, "Provenance", file.Provenance);
            Add(facts, "Trained by", file.Program);
            if (file.TrainingSeconds > 0.0) Add(facts, "Training", Number(file.TrainingSeconds / 60.0, "0.0") + " min");
        }

        private static void Add(List<KeyValuePair<string, string>> facts, string name, string value)
        {
            if (value.Length > 0) facts.Add(new KeyValuePair<string, string>(name, value));
        }

        private static string Number(double value, string format)
        {
            return value.ToString(format, CultureInfo.InvariantCulture);
        }
    }
}
