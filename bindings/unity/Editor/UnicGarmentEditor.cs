using UnityEditor;
using UnityEngine;

namespace Unic.Editor
{
    /// <summary>Inspector of a garment, with a check of its rig.</summary>
    [CustomEditor(typeof(UnicGarment))]
    public sealed class UnicGarmentEditor : UnityEditor.Editor
    {
        private RigReport report;

        /// <inheritdoc/>
        public override void OnInspectorGUI()
        {
            DrawDefaultInspector();
            UnicGarment garment = (UnicGarment)target;
            if (garment.Problem != null) EditorGUILayout.HelpBox(garment.Problem, MessageType.Error);
            if (Application.isPlaying) EditorGUILayout.LabelField("Activity", garment.Activity + ", level " + garment.Detail);
            if (GUILayout.Button("Check the rig")) report = RigReport.Of(garment);
            if (report != null) Draw(report);
        }

        private static void Draw(RigReport report)
        {
            if (report.Problem != null) EditorGUILayout.HelpBox(report.Problem, MessageType.Error);
            foreach (string line in report.summary) EditorGUILayout.LabelField(line);
            foreach (string line in report.joints) EditorGUILayout.LabelField(line);
        }
    }
}
