using System.Collections.Generic;
using UnityEditor;

namespace Unic.Editor
{
    /// <summary>Inspector of a model: its facts.</summary>
    [CustomEditor(typeof(UnicModel))]
    public sealed class UnicModelEditor : UnityEditor.Editor
    {
        private List<KeyValuePair<string, string>> facts;

        /// <inheritdoc/>
        public override void OnInspectorGUI()
        {
            // Read once: the native model is loaded for it.
            if (facts == null) facts = ModelFacts.Of((UnicModel)target);
            foreach (KeyValuePair<string, string> fact in facts)
            {
                if (fact.Key == "Problem") EditorGUILayout.HelpBox(fact.Value, MessageType.Error);
                else EditorGUILayout.LabelField(fact.Key, fact.Value, EditorStyles.wordWrappedLabel);
            }
        }
    }
}
