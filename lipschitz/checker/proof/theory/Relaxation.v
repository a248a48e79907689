(** The lines that the checker finds for the neurons of a box hold all over it. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Claims Slopes Witness Laws Ranges.
Import ListNotations.
Open Scope R_scope.

Definition line_holds (l : line) (y : R) : Prop :=
  match l with
  | On => 0 <= y
  | Off => y <= 0
  | Open low high s t => real low <= y <= real high /\ relu y <= real s * y + real t
  end.
(** Of the layers in front of h, the last one first. *)
Fixpoint reach (before : list (layerD * list line)) (x : list R) : list R :=
  match before with
  | [] => x
  | (w, c, _) :: before' => map relu (affine (realm w) (reals c) (reach before' x))
  end.
Fixpoint valid (before : list (layerD * list line)) (x : list R) : Prop :=
  match before with
  | [] => True
  | (w, c, l) :: before' => Forall2 line_holds l (affine (realm w) (reals c) (reach before' x)) /\ valid before' x
  end.
Fixpoint lines_hold (ls : list layerD) (lines : list (list line)) (h : list R) : Prop :=
  match ls, lines with
  | [], [] => True
  | (w, c) :: ls', l :: lines' =>
      Forall2 line_holds l (affine (realm w) (reals c) h)
      /\ lines_hold ls' lines' (map relu (affine (realm w) (reals c) h))
  | _, _ => False
  end.
(** The same of what is known only of some. *)
Fixpoint known_layer (l : list line) (y : list R) : Prop :=
  match l, y with a :: l', v :: y' => line_holds a v /\ known_layer l' y' | _, _ => True end.
Fixpoint known (ls : list layerD) (around : list (list line)) (h : list R) : Prop :=
  match ls with
  | [] => True
  | (w, c) :: ls' =>
      let y := affine (realm w) (reals c) h in known_layer (hd [] around) y /\ known ls' (tl around) (map relu y)
  end.
Lemma known_layer_of l y : Forall2 line_holds l y -> known_layer l y.
Proof. intros H. induction H; simpl; auto. Qed.
Lemma known_of ls lines h : lines_hold ls lines h -> known ls lines h.
Proof.
  revert lines h. induction ls as [|[w c] ls IH]; intros [|l lines] h; simpl; try tauto. intros [H G].
  split; [now apply known_layer_of|auto].
Qed.
Lemma known_nothing ls h : known ls [] h.
Proof. revert h. induction ls as [|[w c] ls IH]; intros h; simpl; auto. Qed.

Lemma at_most_up o x : real x <= real (up o x).
Proof. unfold up. destruct (at_most x _) eqn:E; [now apply at_most_real|lra]. Qed.
Lemma larger_left x y : real x <= real (larger x y).
Proof. unfold larger. destruct (at_most x y) eqn:E; [now apply at_most_real|lra]. Qed.
Lemma larger_right x y : real y <= real (larger x y).
Proof. unfold larger. destruct (at_most x y) eqn:E; [lra|now apply Rlt_le, at_most_false]. Qed.
Lemma larger_least x y z : real x <= z -> real y <= z -> real (larger x y) <= z.
Proof. unfold larger. now destruct (at_most x y). Qed.
Lemma nonpositive x : is_nonnegative (neg x) = true -> real x <= 0.
Proof. intros H. apply real_nonnegative in H. rewrite real_neg in H. lra. Qed.
Lemma not_nonnegative x : is_nonnegative x = false -> real x <= 0.
Proof.
  intros H. apply nonpositive. unfold is_nonnegative, neg in *. simpl. apply Z.leb_gt in H. apply Z.leb_le. lia.
Qed.

(** ReLU below a line that is above it at both ends. *)
Lemma relu_below_line l h s t y : l <= 0 -> 0 <= h -> h - s * h <= t -> - (s * l) <= t ->
  l <= y <= h -> relu y <= s * y + t.
Proof.
  intros Hl Hh H1 H2 [H3 H4]. unfold relu, Rmax. destruct (Rle_dec 0 y).
  - destruct (Rle_dec s 1).
    + assert ((1 - s) * y <= (1 - s) * h) by (apply Rmult_le_compat_l; lra). lra.
    + assert ((s - 1) * y >= 0) by nra. assert (s * l <= 0) by nra. lra.
  - destruct (Rle_dec 0 s).
    + assert (s * l <= s * y) by (apply Rmult_le_compat_l; lra). lra.
    + assert (s * y >= 0) by nra. assert (s * h <= 0) by nra. lra.
Qed.
Lemma line_of_holds o low high y : real low <= y <= real high -> line_holds (line_of o low high) y.
Proof.
  intros [H1 H2]. unfold line_of. destruct (is_nonnegative low) eqn:L; [apply real_nonnegative in L; simpl; lra|].
  destruct (is_nonnegative (neg high)) eqn:H; [apply nonpositive in H; simpl; lra|].
  apply not_nonnegative in L, H. rewrite real_neg in H. set (s := slope_between o low high). cbn [line_holds].
  split; [lra|]. apply relu_below_line with (l := real low) (h := real high); try lra.
  - eapply Rle_trans; [|apply larger_left]. rewrite real_add, real_neg, real_mul. lra.
  - eapply Rle_trans; [|apply larger_right]. rewrite real_neg, real_mul. lra.
Qed.

Lemma through_relu_above c lines below y : Forall2 line_holds lines y ->
  let (d, k) := through_relu c lines below in dotR (reals c) (map relu y) <= dotR (reals d) y + real k.
Proof.
  intros H. revert c below. induction H as [|l v lines y Hl H IH]; intros [|a c] below; simpl;
    rewrite ?real_zero; try lra.
  specialize (IH c (tl below)). destruct (through_relu c lines (tl below)) as [d k].
  destruct l as [| |low high s t]; simpl in Hl |- *.
  - rewrite relu_right by auto. lra.
  - rewrite relu_left, real_zero by auto. lra.
  - destruct Hl as [_ Hl]. destruct (is_nonnegative a) eqn:A; simpl.
    + apply real_nonnegative in A. rewrite real_mul, real_add, real_mul.
      pose proof (Rmult_le_compat_l _ _ _ A Hl). lra.
    + apply not_nonnegative in A. pose proof (Rmax_l 0 v). pose proof (Rmax_r 0 v). fold (relu v) in *.
      destruct (hd _ below); simpl; rewrite ?real_zero; nra.
Qed.
Lemma real_combined z m : reals (combined z m) = combine_rows (reals z) (realm m) \/
  forall v, dotR (reals (combined z m)) v = dotR (combine_rows (reals z) (realm m)) v.
Proof.
  right. revert m. induction z as [|a z IH]; intros [|r m] v; simpl; auto.
  rewrite dot_plus_l, dot_scale_l. destruct (Z.eqb_spec (fst a) 0) as [E|_].
  - assert (real a = 0) as -> by (unfold real; rewrite E; ring). rewrite IH. ring.
  - rewrite (f_plus add Rplus real real_add), (f_scale mul Rmult real real_mul), dot_plus_l, dot_scale_l, IH. ring.
Qed.
Lemma dot_combined z m v : dotR (reals (combined z m)) v = dotR (reals z) (applyR (realm m) v).
Proof. destruct (real_combined z m) as [-> | ->]; apply dot_combine. Qed.
Lemma real_dot u v : real (dot zero add mul u v) = dotR (reals u) (reals v).
Proof. apply (f_dot zero add mul 0 Rplus Rmult real real_zero real_add real_mul). Qed.
Lemma form_above_holds before below c k x : valid before x ->
  let (d, j) := form_above before below c k in dotR (reals c) (reach before x) + real k <= dotR (reals d) x + real j.
Proof.
  intros V. revert below c k V. induction before as [|[[w bias] lines] before IH]; intros below c k V; simpl; [lra|].
  destruct V as [H V]. pose proof (through_relu_above c lines (hd [] below) _ H) as T.
  destruct (through_relu c lines (hd [] below)) as [d j].
  specialize (IH (tl below) (combined d w) (add (add k j) (dot zero add mul d bias)) V).
  destruct (form_above _ _ _ _) as [e i]. rewrite !real_add, real_dot, dot_combined in IH. unfold affine in T at 2.
  rewrite dot_plus_r in T. lra.
Qed.
Lemma most_above before below c k b x : valid before x -> within b x ->
  dotR (reals c) (reach before x) + real k <= real (most before below c k b).
Proof.
  intros V W. unfold most. pose proof (form_above_holds before below c k x V) as F.
  destruct (form_above before below c k) as [d j]. rewrite real_add. pose proof (row_ends_within d b x W). lra.
Qed.

Section Bounds.
Context (o : hints) (b : box) (x : list R) (W : within b x).
Lemma dot_negated u v : dotR (reals (map neg u)) v = - dotR (reals u) v.
Proof.
  revert v. induction u as [|a u IH]; intros [|c v]; simpl; try ring. rewrite IH, real_neg. ring.
Qed.
Lemma new_line_holds before row bias around y : valid before x -> y = dotR (reals row) (reach before x) + real bias ->
  match around with [] => True | l :: _ => line_holds l y end -> line_holds (new_line o b before row bias around) y.
Proof.
  intros V E K. unfold new_line.
  pose proof (most_above before [] row bias b x V W) as U. rewrite <- E in U.
  pose proof (most_above before [] (map neg row) (neg bias) b x V W) as L. rewrite dot_negated, real_neg in L.
  pose proof (at_most_up o (most before [] row bias b)).
  pose proof (at_most_up o (most before [] (map neg row) (neg bias) b)).
  set (high := up o (most before [] row bias b)) in *.
  set (low := up o (most before [] (map neg row) (neg bias) b)) in *.
  assert (real (neg low) <= y) by (rewrite real_neg; lra).
  destruct around as [|[| |l h s t] around]; auto; apply line_of_holds; [lra|]. destruct K as [[K1 K2] _].
  split; [now apply larger_least|]. destruct (at_most h high); lra.
Qed.
Lemma new_lines_hold before w c around : valid before x -> length c = length w ->
  known_layer around (affine (realm w) (reals c) (reach before x)) ->
  Forall2 line_holds (new_lines o b before w c around) (affine (realm w) (reals c) (reach before x)).
Proof.
  intros V. revert c around. induction w as [|row w IH]; intros [|a c] around; simpl; try discriminate; [constructor|].
  intros H K. constructor.
  - apply new_line_holds; auto. destruct around; auto. simpl in K. tauto.
  - apply IH; [lia|]. destruct around; simpl in *; [now destruct w, c|tauto].
Qed.
Lemma Forall2_nth {A B} (P : A -> B -> Prop) l y n a d : Forall2 P l y -> nth_error l n = Some a -> P a (nth n y d).
Proof.
  intros H. revert n. induction H as [|c v l y Hc H IH]; intros [|n]; simpl; try discriminate; auto.
  intros E. inversion E. now subst.
Qed.
Lemma Forall2_replaced {A B} (P : A -> B -> Prop) l y n a d : Forall2 P l y -> (n < length l)%nat -> P a (nth n y d) ->
  Forall2 P (firstn n l ++ a :: skipn (S n) l) y.
Proof.
  intros H. revert n. induction H as [|c v l y Hc H IH]; intros [|n]; simpl; intros L G; try lia.
  - now constructor.
  - constructor; auto. apply IH; auto. lia.
Qed.
Lemma nth_affine w c h n : length c = length w -> (n < length w)%nat ->
  nth n (affine (realm w) (reals c) h) 0 = dotR (reals (nth n w [])) h + real (nth n c zero).
Proof.
  revert c n. induction w as [|row w IH]; intros [|a c] [|n]; simpl; try discriminate; intros H L; try lia; auto.
  apply IH; lia.
Qed.
Lemma decide_holds before w c lines d lines' : valid before x -> length c = length w ->
  Forall2 line_holds lines (affine (realm w) (reals c) (reach before x)) ->
  decide b before w c lines d = Some lines' ->
  Forall2 line_holds lines' (affine (realm w) (reals c) (reach before x)).
Proof.
  intros V L H. unfold decide. destruct (nth_error lines (neuron d)) as [[| |l h s t]|] eqn:E; try discriminate;
    try (intros G; inversion G; now subst).
  assert (neuron d < length lines)%nat as N by (apply nth_error_Some; congruence).
  pose proof (Forall2_lengths _ _ _ H) as Q. rewrite length_affine in Q by (now rewrite !map_length).
  rewrite map_length in Q. pose proof (nth_affine w c (reach before x) (neuron d) L ltac:(lia)) as Y.
  destruct (is_nonnegative _) eqn:K; [|discriminate]. apply nonpositive in K. intros G. inversion G. subst lines'.
  apply Forall2_replaced with (d := 0); auto. rewrite Y. destruct (is_on d); simpl.
  - pose proof (most_above before (lower_slopes d) (map neg (nth (neuron d) w []))
      (neg (nth (neuron d) c zero)) b x V W) as M.
    rewrite dot_negated, real_neg in M. lra.
  - pose proof (most_above before (lower_slopes d) (nth (neuron d) w []) (nth (neuron d) c zero) b x V W). lra.
Qed.
Lemma decide_all_holds before w c lines ds lines' : valid before x -> length c = length w ->
  Forall2 line_holds lines (affine (realm w) (reals c) (reach before x)) ->
  decide_all b before w c lines ds = Some lines' ->
  Forall2 line_holds lines' (affine (realm w) (reals c) (reach before x)).
Proof.
  intros V L. revert lines. induction ds as [|d ds IH]; intros lines H; simpl; [intros G; inversion G; now subst|].
  destruct (decide b before w c lines d) eqn:E; [|discriminate]. apply IH. eapply decide_holds; eauto.
Qed.
Lemma bounds_hold_after before ls around ds lines : valid before x ->
  Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  known ls around (reach before x) -> bounds o b before ls around ds = Some lines ->
  lines_hold ls lines (reach before x).
Proof.
  revert before around ds lines. induction ls as [|[w c] ls IH]; intros before around ds lines V F K; simpl.
  - intros G. inversion G. exact I.
  - inversion F as [|? ? Hc F']; subst. simpl in Hc. destruct K as [K1 K2].
    destruct (decide_all _ _ _ _ _ _) as [l|] eqn:E; [|discriminate].
    destruct (bounds o b ((w, c, l) :: before) ls (tl around) (tl ds)) as [r|] eqn:G; [|discriminate].
    intros S. inversion S. subst.
    pose proof (decide_all_holds _ _ _ _ _ _ V Hc (new_lines_hold _ _ _ _ V Hc K1) E) as D.
    split; auto. apply (IH ((w, c, l) :: before) _ _ _ (conj D V) F' K2 G).
Qed.
Lemma bounds_hold ls around ds lines : Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  known ls around x -> bounds o b [] ls around ds = Some lines -> lines_hold ls lines x.
Proof. intros F K G. exact (bounds_hold_after [] ls around ds lines I F K G). Qed.
End Bounds.
