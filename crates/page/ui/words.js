// One table of messages: key → [English, Japanese]. `{name}` is filled in.

const TABLE = {
  sites: ["Sites", "現場一覧"],
  compare: ["Compare surveys", "測量の比較"],
  "nothing-leaves": ["Everything stays on this machine: no file and no figure is sent anywhere.", "データはすべてこの PC 内で処理され、外部へは一切送信されません。"],
  "no-sites": ["There is no site in this folder yet. Make the first one from a survey.", "このフォルダーにはまだ現場がありません。測量ファイルから最初の現場を作成してください。"],
  folder: ["Folder", "フォルダー"], free: ["{size} free", "空き {size}"],
  "open-site": ["Open", "開く"], runs: ["runs", "計算結果"], "latest": ["latest result", "最新の結果"],
  "never-run": ["not run yet", "未計算"], "unfinished-run": ["interrupted, can go on", "中断（再開できます）"],
  "answer-plan": ["{found} blocks recognised, {added} to place ({mass} t)", "認識 {found} 個、据付計画 {added} 個（{mass} t）"],
  "answer-inventory": ["{found} blocks recognised", "認識 {found} 個"],
  "new-site": ["New site", "新しい現場"],
  "drop-here": ["Drop survey files here, or choose them", "測量ファイルをここにドロップ、または選択"],
  "drop-kinds": ["LAS, LAZ, COPC, E57, PLY, PCD or text with x y z. Files that lie in the folder already need no upload: choose them below.", "LAS・LAZ・COPC・E57・PLY・PCD・XYZ テキスト。フォルダー内にあるファイルは下の一覧から選べます（取り込み不要）。"],
  "choose-files": ["Choose files …", "ファイルを選択…"],
  "files-here": ["Survey files in this folder", "フォルダー内の測量ファイル"], "no-files": ["none yet", "なし"],
  "site-name": ["Name of the site", "現場名"], block: ["Block", "ブロック"],
  "make-site": ["Make the site", "現場を作成"], "making-site": ["Reading the surveys …", "測量を読み込み中…"],
  uploading: ["{name}: {share} %", "{name}：{share} %"], "upload-done": ["{name} is stored", "{name} を保存しました"], cancel: ["Cancel", "取消"],
  "tab-setup": ["1 Set up", "1 設定"], "tab-run": ["2 Check and run", "2 点検・計算"], "tab-results": ["3 Results", "3 結果"], "tab-variants": ["4 What if", "4 比較検討"],
  "site-data": ["Site", "現場"], "survey-date": ["Day of the survey", "測量日"], datum: ["Vertical datum, in words", "高さの基準（例：T.P.、C.D.L.）"],
  coordinates: ["Coordinates", "座標系"], crs: ["Coordinate system", "平面座標系"],
  "crs-hint": ["EPSG code of plane coordinates in metres, or none for a bin", "メートル単位の平面座標の EPSG コード（座標系なしは none）"],
  "crs-file": ["The surveys say: {crs}", "測量ファイルの記載：{crs}"], "crs-silent": ["No survey file says which system it is in.", "測量ファイルに座標系の記載がありません。"],
  "crs-use": ["Use it", "これを使う"], axes: ["Columns of the surveys", "測量ファイルの列"], "axes-en": ["first east, then north", "1 列目が東（Y）、2 列目が北（X）"], "axes-ne": ["first north, then east", "1 列目が北（X）、2 列目が東（Y）"],
  surveys: ["Surveys", "測量"], sensor: ["Measured by", "計測方法"], offset: ["Added to its heights, m", "高さの補正値 (m)"], remove: ["Remove", "除く"], "add-survey": ["Add a survey …", "測量を追加…"],
  "sensor-uav": ["drone photographs or laser scanner", "UAV 写真測量・レーザ"], "sensor-mbes": ["multibeam echo sounder", "マルチビーム測深"], "sensor-depth-camera": ["depth camera (bin)", "デプスカメラ（箱）"], "sensor-unknown": ["not known", "不明"],
  "survey-found": ["{points} points, {density} a m², heights {low} to {high} m", "{points} 点、{density} 点/m²、高さ {low}～{high} m"],
  blocks: ["Blocks in the pile", "山のブロック"], "add-block": ["Add another type", "種類を追加"], density: ["Density, kg/m³", "密度 (kg/m³)"],
  "block-facts": ["{height} m high, {volume} m³, {mass} t; a survey of this density puts about {points} points on one", "高さ {height} m、体積 {volume} m³、質量 {mass} t；この密度では 1 個あたり約 {points} 点"],
  "block-facts-short": ["{height} m high, {volume} m³, {mass} t", "高さ {height} m、体積 {volume} m³、質量 {mass} t"],
  "block-size": ["Circles of the block's size are drawn on map and section: one block of the pile should fit into one.", "地図と断面にブロック大の円を表示しています。山の 1 個が円に収まるか確認してください。"],
  "block-height": ["Height, m", "高さ（m）"], "size-seen": ["The survey shows {size} m, over {n} blocks.", "測量では {size} m（{n} 個）です。"], "size-use": ["Use this size", "この寸法を使う"],
  "own-mesh": ["own mesh: {file}", "独自形状：{file}"], "own-shape": ["{kind}, {size} m", "{kind}、{size} m"],
  design: ["Design", "計画面"], "design-none": ["none: count the blocks only", "なし（個数の調査のみ）"], "design-level": ["one level inside a boundary", "一定の高さ（範囲を指定）"], "design-section": ["cross-section along an alignment", "法線に沿った標準断面"], "design-file": ["surface from a file", "ファイルの計画面"], "design-other": ["as written in site.toml", "site.toml の記述どおり"],
  level: ["Level, m", "高さ (m)"], boundary: ["Boundary: east, north of each corner, a line each", "範囲：各頂点の 東（Y）, 北（X） を 1 行ずつ"], alignment: ["Alignment: east, north of each point, a line each", "法線：各点の 東（Y）, 北（X） を 1 行ずつ"],
  "alignment-file": ["Alignment from a file", "法線をファイルから"], "own-points": ["drawn or typed here", "ここで作図・入力"], draw: ["Draw on the map", "地図上に描く"], "draw-end": ["Finish drawing", "作図を終える"],
  "draw-help": ["Click to set points, or move the cross with the arrow keys and press Space. Backspace takes one back, Enter ends.", "クリックで点を置きます（矢印キーで十字を動かし、Space で置くこともできます）。Backspace で 1 点戻し、Enter で終了。"],
  "crest-level": ["Crest level, m", "天端高 (m)"], "crest-width": ["Crest width, m", "天端幅 (m)"], "left-slope": ["Slope on the left, 1 :", "左側法面勾配 1 :"], "right-slope": ["Slope on the right, 1 :", "右側法面勾配 1 :"], toe: ["Slopes end at, m", "法尻の高さ (m)"],
  "left-right": ["Left and right as seen along the alignment, from its first point.", "左右は法線の始点から終点を見た向きです。"],
  "design-cell": ["Spacing of the surface's grid, m", "計画面の格子間隔 (m)"], "choose": ["choose …", "選択…"],
  map: ["Height map", "標高図"], "map-none": ["The map appears when the surveys have been read.", "測量を読み込むと標高図が表示されます。"], "map-show": ["Show", "表示"], "show-height": ["heights", "標高"], "show-difference": ["distance to the design", "計画面との差"],
  "map-read": ["east {e}, north {n}, height {z} m", "東（Y）{e}、北（X）{n}、高さ {z} m"], "map-design": ["design {z} m", "計画 {z} m"],
  "void-estimate": ["Space below the design: about {void} m³ with its pores, on {area} m² of works", "計画面までの不足量：約 {void} m³（空隙を含む）、計画範囲 {area} m²"],
  profile: ["Section", "断面"], chainage: ["Chainage {at} m", "測点 {at} m"], "profile-survey": ["survey", "測量"], "profile-design": ["design", "計画"], "profile-block": ["block to scale", "ブロック（同縮尺）"],
  saved: ["Saved", "保存済み"], saving: ["Saving …", "保存中…"], unsaved: ["Not saved yet", "未保存"], "needs-number": ["a number is needed here", "数値を入力してください"], "needs-points": ["at least {n} points are needed", "{n} 点以上必要です"], "needs-file": ["choose a file", "ファイルを選択してください"], "needs-name": ["a name is needed here", "名前を入力してください"],
  "changed-elsewhere": ["This site was changed elsewhere, in another window perhaps. Load it again; what you typed last is not saved.", "この現場は別の画面などで変更されました。再読込してください（直前の入力は保存されていません）。"], reload: ["Load again", "再読込"],
  checking: ["Reading the surveys and checking …", "測量を読み込み、点検中…"], "check-again": ["Check again", "再点検"], "check-ok": ["The site can be answered.", "計算できます。"], "check-no": ["The site cannot be answered yet:", "このままでは計算できません："],
  "no-complaints": ["No complaints.", "指摘はありません。"], refusal: ["must be mended", "要修正"], warning: ["doubtful", "要確認"], note: ["note", "参考"],
  expected: ["{points} points; about {time} on two cores, {memory} of memory (a guess)", "{points} 点；2 コアで約 {time}、メモリー {memory}（目安）"],
  "run-now": ["Start the run", "計算を開始"], "run-on": ["Go on with the interrupted run", "中断した計算を再開"], "run-again": ["Run again (a new result; the earlier ones stay)", "再計算（新しい結果として保存。以前の結果は残ります）"], stop: ["Stop", "中止"],
  "state-waiting": ["waiting for other work", "待機中"], "state-running": ["at work", "計算中"], "state-done": ["done", "完了"], "state-failed": ["failed", "失敗"], "state-stopped": ["stopped: nothing is lost; finished parts are kept and the next start goes on from them", "中止しました（完了した段階は保存され、次回はそこから再開します）"], "state-died": ["ended by the system, for want of memory perhaps; finished parts are kept. The largest survey that fits is said in the guide under limits.", "システムにより終了されました（メモリー不足の可能性）。完了した段階は保存されています。扱える大きさはガイドの「限界」を参照してください。"],
  "kept-parts": ["taken over from the interrupted run: {parts}", "中断前の結果を使用：{parts}"], elapsed: ["{time} gone", "経過 {time}"], "see-results": ["See the results", "結果を見る"],
  "stage-read": ["read", "読込"], "stage-check": ["check", "点検"], "stage-segment": ["which point belongs to which block", "点群をブロックごとに分割"], "stage-pose": ["position and attitude of every block", "各ブロックの位置姿勢を推定"], "stage-recognise": ["recognise", "認識"], "stage-plan": ["plan the placing", "積み方計画"], "stage-uncertainty": ["range of the count", "個数の幅を計算"], "stage-report": ["report and drawings", "報告書・図面"],
  warnings: ["Warnings", "注意"], errors: ["Why", "原因"],
  result: ["Result", "結果"], report: ["Report", "報告書"], "own-tab": ["In a tab of its own", "別タブで開く"], downloads: ["Files", "ファイル"], "no-results": ["No finished run yet.", "完了した計算はまだありません。"], "result-gone": ["This result is not there any more: its folder was moved or deleted.", "この結果はフォルダーが移動または削除されたため、表示できません。"],
  "review-kept": ["{n} decisions are kept in the site; the next run applies them.", "照査 {n} 件を現場に保存しました。次回の計算に反映されます。"], "review-failed": ["The review could not be kept: {why}", "照査結果を保存できません：{why}"],
  "what-if-intro": ["Plans on the same recognised blocks with something otherwise. What is left empty stays as it is.", "同じ認識結果に対し、条件を変えた積み方計画を比較します。空欄は現状のままです。"],
  "v": ["Least void v, m³", "最小不足量 v (m³)"], "f": ["Overflow f, m", "はみ出し許容 f (m)"], "block-to-place": ["Block to place", "据付ブロック"], "as-now": ["as now", "現状"], "add-plan": ["Plan", "計画する"], "base-plan": ["now", "現状"], "nothing-changed": ["Change one of them first.", "いずれかを変更してください。"],
  "col-plan": ["Plan", "計画"], "col-change": ["Otherwise", "変更点"], "col-blocks": ["Blocks", "個数"], "col-mass": ["Mass, t", "質量 (t)"], "col-concrete": ["Concrete, m³", "コンクリート (m³)"], "col-void": ["Void left, m³", "残りの不足量 (m³)"], "col-filled": ["Filled, %", "充填率 (%)"], "col-high": ["Above the design", "計画面超過"], "col-distance": ["Mean distance, m", "平均差 (m)"], "col-files": ["Files", "ファイル"], "take-over": ["Take over into the site", "現場の設定に反映"], "taken-over": ["Taken over; run again for a report of it.", "反映しました。再計算すると報告書に反映されます。"], "not-planned": ["no plan came of it", "計画が得られませんでした"],
  "compare-intro": ["What happened to every block between surveys. Choose at least two results, the earliest first.", "複数時期の測量から各ブロックの変化を調べます。古い順に 2 つ以上選んでください。"], epoch: ["Epoch {n}", "時期 {n}"], "add-epoch": ["One more", "追加"], "comparison-name": ["Name of the comparison", "比較の名称"], "start-compare": ["Compare", "比較する"], comparisons: ["Comparisons", "比較結果"], "no-comparisons": ["none yet", "なし"], "needs-two-runs": ["Two sites, or one site with two results, are needed.", "現場 2 つ、または結果が 2 つある現場が必要です。"],
  lost: ["The program does not answer: it was closed perhaps. Start `tsumu open` again; nothing that was saved is lost.", "プログラムが応答しません（終了した可能性があります）。もう一度 `tsumu open` を起動してください。保存済みのデータは失われていません。"],
  "e-gone": ["Not there any more: {what}", "見つかりません：{what}"], "e-outside": ["Outside the folder that was opened: {what}", "開いたフォルダーの外です：{what}"], "e-name": ["No name that can be used: {what}", "使用できない名前です：{what}"], "e-name-taken": ["There is a folder of this name already: {what}", "同名のフォルダーがあります：{what}"], "e-no-survey": ["Choose a survey first.", "測量ファイルを選択してください。"], "e-kind-of-file": ["Not a kind of file that is read: {what}", "対応していない種類のファイルです：{what}"], "e-no-room": ["There is no room for it: {what}. Free some space, or put the file into the folder from another drive.", "空き容量が足りません：{what}。空きを確保してください。"], "e-file-there": ["A file of this name is stored already; choose it in the list, or rename yours: {what}", "同名のファイルが保存されています。一覧から選ぶか、名前を変えてください：{what}"], "e-broken-off": ["The upload broke off; nothing of it was kept: {what}", "取り込みが中断されました（何も保存されていません）：{what}"], "e-length": ["The size of the file is not known.", "ファイルの大きさが不明です。"], "e-at-work": ["This is being worked on already, in another window perhaps: {what}", "既に計算中です（別の画面の可能性）：{what}"], "e-no-run": ["This needs a finished run first.", "先に計算を完了してください。"], "e-epochs": ["A comparison needs two surveys at least.", "比較には 2 時期以上の測量が必要です。"], "e-host": ["This address is not served here.", "このアドレスでは利用できません。"], "e-origin": ["Only the page itself may change something.", "この画面以外からの変更は受け付けません。"], "e-message": ["The page and the program do not understand each other; load the page again: {what}", "画面とプログラムが一致しません。再読込してください：{what}"], "e-system": ["{what}", "{what}"], "e-input": ["{what}", "{what}"],
  "unreadable": ["The site's files cannot be read; mend them by hand:", "現場のファイルを読み込めません。内容を修正してください："],
  seconds: ["{n} s", "{n} 秒"], minutes: ["{n} min", "{n} 分"], hours: ["{n} h", "{n} 時間"],
};

export const language = () => document.documentElement.dataset.lang;

export function t(key, values = {}) {
  const pair = TABLE[key];
  if (!pair) return key;
  return pair[language() === "ja" ? 1 : 0].replace(/\{(\w+)\}/g, (_, name) => values[name] ?? "");
}

// Every key, for the test that holds the table together.
export const KEYS = Object.keys(TABLE);
