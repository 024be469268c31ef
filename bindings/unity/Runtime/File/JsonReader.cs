using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace Unic
{
    /// <summary>Reads JSON text. Unity's JsonUtility reads no objects of unknown keys.</summary>
    /// <remarks>
    /// Values are Dictionary, List, string, double, bool or null. For the headers of model files.
    /// </remarks>
    internal sealed class JsonReader
    {
        private const int MostDepth = 64;

        private readonly string text;
        private int at;

        private JsonReader(string text)
        {
            this.text = text;
        }

        /// <summary>Reads one value.</summary>
        /// <exception cref="UnicException">The text is not JSON.</exception>
        internal static object Read(string text)
        {
            JsonReader reader = new JsonReader(text);
            object value = reader.Value(0);
            reader.Skip();
            if (reader.at != text.Length) throw reader.Fault("the end");
            return value;
        }

        private object Value(int depth)
        {
            if (depth > MostDepth) throw Fault("at most " + MostDepth + " levels");
            Skip();
            switch (Peek())
            {
                case '{': return Object(depth);
                case '[': return Array(depth);
                case '"': return Text();
                case 't': return Word("true", true);
                case 'f': return Word("false", false);
                case 'n': return Word("null", null);
                default: return Number();
            }
        }

        private Dictionary<string, object> Object(int depth)
        {
            Dictionary<string, object> members = new Dictionary<string, object>();
            at++;
            if (Next('}')) return members;
            do
            {
                Skip();
                string key = Text();
                if (!Next(':')) throw Fault("a colon");
                members[key] = Value(depth + 1);
            } while (Next(','));
            if (!Next('}')) throw Fault("a brace");
            return members;
        }

        private List<object> Array(int depth)
        {
            List<object> items = new List<object>();
            at++;
            if (Next(']')) return items;
            do items.Add(Value(depth + 1));
            while (Next(','));
            if (!Next(']')) throw Fault("a bracket");
            return items;
        }

        private string Text()
        {
            if (Peek() != '"') throw Fault("a text");
            StringBuilder read = new StringBuilder();
            for (at++; Peek() != '"'; at++)
            {
                if (text[at] != '\\')
                {
                    read.Append(text[at]);
                    continue;
                }
                at++;
                read.Append(Escaped());
            }
            at++;
            return read.ToString();
        }

        private char Escaped()
        {
            switch (Peek())
            {
                case 'n': return '\n';
                case 't': return '\t';
                case 'r': return '\r';
                case 'b': return '\b';
                case 'f': return '\f';
                case 'u':
                    int code;
                    if (at + 4 >= text.Length || !int.TryParse(text.Substring(at + 1, 4), NumberStyles.AllowHexSpecifier,
                            CultureInfo.InvariantCulture, out code)) throw Fault("four hexadecimal digits");
                    at += 4;
                    return (char)code;
                default: return text[at];
            }
        }

        private object Word(string word, object value)
        {
            if (string.CompareOrdinal(text, at, word, 0, word.Length) != 0) throw Fault(word);
            at += word.Length;
            return value;
        }

        private double Number()
        {
            int start = at;
            while (at < text.Length && "+-.0123456789eE".IndexOf(text[at]) >= 0) at++;
            double value;
            if (!double.TryParse(text.Substring(start, at - start), NumberStyles.Float, CultureInfo.InvariantCulture,
                    out value)) throw Fault("a number");
            return value;
        }

        private bool Next(char c)
        {
            Skip();
            if (at >= text.Length || text[at] != c) return false;
            at++;
            return true;
        }

        private void Skip()
        {
            while (at < text.Length && char.IsWhiteSpace(text[at])) at++;
        }

        private char Peek()
        {
            if (at >= text.Length) throw Fault("more text");
            return text[at];
        }

        private UnicException Fault(string expected)
        {
            return new UnicException("expected " + expected + " at character " + at + " of the JSON text");
        }
    }
}
