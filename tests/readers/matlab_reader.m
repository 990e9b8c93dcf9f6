% Reads an XDF file with an unmodified load_xdf.m, EEGLAB's (https://github.com/xdf-modules/xdf-Matlab) or FieldTrip's, in GNU Octave.
% octave matlab_reader.m FOLDER_OF_LOAD_XDF FILE OUT: a line for each stream, its times in OUT/K.times, its values in OUT/K.values.
% Octave lacks what load_xdf.m takes from Java and from newer MATLABs; replacements are below.
1;

function import(varargin)
end

function yes = contains(text, part)
  yes = ! isempty(strfind(text, part));
end

function file = fopen(name, mode, order)
  file = builtin("fopen", name, mode, "ieee-le");
end

function middle = median(values)
  values = sort(values(:));
  middle = NaN;
  if ! isempty(values)
    middle = (values(floor((end + 1) / 2)) + values(ceil((end + 1) / 2))) / 2;
  end
end

% The text passes from StringReader through setCharacterStream to xmlread.
function text = StringReader(text)
  text = text(:)';
end

function source = InputSource()
  source.setCharacterStream = @(text) setappdata(0, "xml", text);
end

function node = xml_node(name, children)
  node.getNodeName = name;
  node.hasChildNodes = ! isempty(children);
  node.getChildNodes.getLength = numel(children);
  node.getChildNodes.item = @(k) children{k + 1};
end

function node = text_node(text)
  node = xml_node("#text", {});
  node.getData = strrep(strrep(strrep(strrep(strrep(text, "&lt;", "<"), "&gt;", ">"), "&quot;", '"'), "&apos;", "'"), "&amp;", "&");
end

function document = xmlread(source)
  text = getappdata(0, "xml");
  [first, last, tags] = regexp(text, '<[^>]*>', "start", "end", "match");
  names = {"#document"};
  lists = {{}};
  for k = 1:numel(tags)
    if k > 1 && first(k) > last(k - 1) + 1
      lists{end}{end + 1} = text_node(text(last(k - 1) + 1:first(k) - 1));
    end
    tag = tags{k};
    if any(tag(2) == "?!")
      continue;
    elseif tag(2) == "/"
      node = xml_node(names{end}, lists{end});
      names(end) = [];
      lists(end) = [];
      lists{end}{end + 1} = node;
    elseif tag(end - 1) == "/"
      lists{end}{end + 1} = xml_node(strtok(tag(2:end - 2)), {});
    else
      names{end + 1} = strtok(tag(2:end - 1));
      lists{end + 1} = {};
    end
  end
  document = xml_node("#document", lists{1});
end

folders = argv();
addpath(folders{1});
streams = load_xdf(folders{2});
for k = 1:numel(streams)
  stream = streams{k};
  printf("stream %d %s %s %d %d\n", k, stream.info.name, stream.info.nominal_srate, size(stream.time_series, 1), ...
         numel(stream.time_stamps));
  for part = {"times", "values"}
    file = builtin("fopen", fullfile(folders{3}, sprintf("%d.%s", k, part{1})), "w");
    if strcmp(part{1}, "times")
      fwrite(file, stream.time_stamps, "double");
    elseif iscell(stream.time_series)
      fprintf(file, "%s\n", stream.time_series{:});
    else
      fwrite(file, stream.time_series, "double");
    end
    fclose(file);
  end
end
