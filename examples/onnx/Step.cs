// Steps the ONNX graphs of a garment: Step FOLDER POSES OUT, with the FOLDER of `unic export`. POSES holds
// little-endian floats: in each frame the root x, y, z and the joints' local rotations x, y, z, w, in the model's
// order. An engine takes both from its animation. OUT gets the world positions of all frames, in metres.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Runtime.InteropServices;
using System.Runtime.Serialization.Json;
using System.Xml;
using System.Xml.Linq;
using Microsoft.ML.OnnxRuntime;

static class Step {
    static OrtValue Tensor(float[] data, params long[] shape) => OrtValue.CreateTensorValueFromMemory(data, shape);
    static void Main(string[] arguments) {
        var folder = arguments[0] + "/";
        var json = File.ReadAllBytes(folder + "model.json");
        var model = XElement.Load(JsonReaderWriterFactory.CreateJsonReader(json, XmlDictionaryReaderQuotas.Max));
        int joints = model.Element("joints").Elements().Count(), stride = 4 * (3 + 4 * joints);
        float[][] roots = { new float[3], new float[3] }, rotations = { new float[4 * joints], new float[4 * joints] };
        var known = new float[1];  // Tensors share the memory of these arrays, which frames are copied into.
        var values = new Dictionary<string, OrtValue> {
            ["root"] = Tensor(roots[0], 3), ["rotations"] = Tensor(rotations[0], joints, 4),
            ["next_root"] = Tensor(roots[1], 3), ["next_rotations"] = Tensor(rotations[1], joints, 4),
            ["next_known"] = Tensor(known, 1), ["ground_height"] = Tensor(new float[1], 1),
            ["wind"] = Tensor(new float[3], 3) };
        var mesh = File.ReadAllBytes(folder + "mesh.bin");
        var arrays = model.Element("mesh").Element("arrays").Elements();
        foreach (var array in arrays.Where(a => (string)a.Element("type") == "float32")) {
            var shape = array.Element("shape").Elements().Select(length => (long)length).ToArray();
            var numbers = new float[shape.Aggregate((a, b) => a * b)];
            Buffer.BlockCopy(mesh, (int)array.Element("offset"), numbers, 0, 4 * numbers.Length);
            values[(string)array.Element("name")] = Tensor(numbers, shape);
        }
        var poses = File.ReadAllBytes(arguments[1]);
        using (var options = new RunOptions())
        using (var start = new InferenceSession(folder + "start.onnx"))
        using (var tick = new InferenceSession(folder + "tick.onnx"))
        using (var output = File.Create(arguments[2])) {
            IDisposableReadOnlyCollection<OrtValue> outputs = null;
            for (int frame = 0; stride * frame < poses.Length; frame++) {
                var graph = frame == 0 ? start : tick;
                for (int i = 0; i < 2; i++) {
                    int at = Math.Min(stride * (frame + i), poses.Length - stride);
                    Buffer.BlockCopy(poses, at, roots[i], 0, 12);
                    Buffer.BlockCopy(poses, at + 12, rotations[i], 0, 16 * joints);
                }
                known[0] = stride * (frame + 1) < poses.Length ? 1 : 0;
                var before = outputs;
                var inputs = graph.InputNames.Select(name => values[name]).ToList();
                outputs = graph.Run(options, graph.InputNames, inputs, graph.OutputNames);
                before?.Dispose();  // Not earlier: the state was among the inputs.
                for (int i = 0; i < outputs.Count; i++)
                    values[graph.OutputNames[i].Replace("_out", "")] = outputs.ElementAt(i);
                output.Write(MemoryMarshal.AsBytes(values["positions"].GetTensorDataAsSpan<float>()));
            }
        }
    }
}
